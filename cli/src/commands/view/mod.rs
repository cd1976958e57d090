//! `tumble view`: a page that shows boxes turning, skeletons moving and bodies on paths, in any browser.

mod ghosts;
pub(crate) mod pack;
pub(crate) mod page;
pub(crate) mod result;
mod shown;
#[cfg(test)]
mod tests;

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use tumble::{FrameRate, Method};
use tumble_formats::carried_mesh::CarriedMesh;
use tumble_formats::motion::Motion;

use crate::arguments::device::{DeviceArguments, OpenedDevice};
use crate::arguments::input::Inputs;
use crate::arguments::interpolation::{
    InterpolationArguments, MethodArgumentSelection, each_once, method_arguments,
};
use crate::arguments::options::CommandLine;
use crate::arguments::path::{PATHS, PathArguments};
use crate::arguments::time::{finite_seconds, in_frames};
use crate::arguments::tracks::selected;
use crate::batch::entry::InputEntry;
use crate::batch::target::{self, Destination};
use crate::commands::travel::{Scenery, TravelSource, is_path_file};
use crate::commands::view::ghosts::{FoundGhosts, find_ghosts};
use crate::commands::view::page::{Page, StoredSet};
use crate::commands::view::shown::{ResultChoice, ShownClip};
use crate::messages::drawn::{DrawnFile, note_scalars};
use crate::messages::exit::{Failure, OUTPUT, SOME_INPUTS, for_each};
use crate::messages::progress::Progress;
use crate::messages::warnings::WarningMark;
use crate::messages::{listing, names, words};
use tumble_formats::sample::MethodChoice;

/// Bytes of rotations, speeds and positions that a page may hold, before they are packed.
const MAX_PAGE_BYTES: f64 = 256e6;
/// If no method is named, the page shows all methods as long as it is not larger than this.
const SMALL_PAGE_BYTES: f64 = 24e6;

/// Write an HTML file that shows boxes, skeletons or bodies on paths in 3D
#[derive(Debug, Args)]
#[command(after_help = "\
The file needs no network and no other files. It contains the rotations and positions at the frames \
and at the keys. Other methods, rates and times are evaluated in the page, by the same engine with \
the same bits. Skeletons are drawn as bones, with the meshes of a glTF file, and all animations of a \
file are in a menu. Files of paths, and joints without parents that move, are drawn as boxes on their \
paths, with frames as small axes. \
Several inputs are shown together and in time with each other: the first one solid, the others as translucent \
ghosts, each in a different colour. A list names them, can hide each, and shows the joint with the largest \
difference from the solid input; a menu selects the solid input. Joints, and animations of files with \
several, are matched by equal names.

Examples:
  tumble view data/pendulum.dat -o pendulum.html
  tumble view data/pendulum.dat --open
  tumble view take.bvh cleaned.npz -o both.html     the second as a ghost of the first
  tumble view a.dat b.dat -m slerp,c2 --no-ghosts -o menu.html
  tumble view road.csv --path-frame minimal,frenet --path-speed constant --open
  tumble view walker.glb --mesh hill.obj,rocks.obj -o walker.html")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    #[command(flatten)]
    inputs: Inputs,
    /// Where to write: a page (`-`: standard output) [default with --open: a temporary file]
    #[arg(
        short,
        long = "output",
        alias = "out",
        value_name = "FILE.html",
        required_unless_present = "open"
    )]
    out: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Print JSON: about the page and the inputs that failed
    #[arg(long)]
    json: bool,
    /// Open the page in the browser
    #[arg(long)]
    open: bool,
    /// How to interpolate: the methods to choose from, or all; the first is shown first [default: all where the
    /// page stays small, else authored,bessel-overhauser,slerp,catmull-rom,b-spline]
    #[arg(short, long = "method", value_name = "METHODS", value_delimiter = ',', value_parser = method_arguments())]
    methods: Vec<MethodArgumentSelection>,
    /// Frames per second: a number or a ratio
    #[arg(
        long,
        value_name = "FPS",
        default_value = "60",
        allow_hyphen_values = true
    )]
    fps: FrameRate,
    /// Where to start, seconds [default: the first key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    start: Option<f64>,
    /// Where to end, seconds [default: the last key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    end: Option<f64>,
    /// Show one input at a time, chosen in a menu, without the others as ghosts
    #[arg(long)]
    no_ghosts: bool,
    /// Leave the engine and the full keys out of the page: it is smaller, and shows only the requested
    /// methods and frames
    #[arg(long)]
    frames_only: bool,
    #[command(flatten, next_help_heading = PATHS)]
    scenery: Scenery,
    #[command(flatten, next_help_heading = PATHS)]
    path: PathArguments,
    #[command(flatten)]
    interpolation: InterpolationArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = arguments.inputs.distinct(false)?;
    let destination = arguments.destination(&inputs)?;
    if !destination.is_standard() {
        destination.check_writable()?;
    }
    let mut shown = Vec::new();
    let mut refused = 0;
    let mut failed = Vec::new();
    let mut read = |path: &PathBuf| {
        if is_path_file(path) {
            let source = TravelSource::of_paths(path, &arguments.path, &arguments.inputs.tracks)?;
            shown.push(arguments.sampled(ShownClip::of_paths(path, source))?);
            return Ok(());
        }
        let loaded = arguments.inputs.load(path)?;
        refused += loaded.refused.len();
        let several = loaded.clips.len() + loaded.refused.len() > 1;
        let document = loaded.document_in_place();
        for clip in loaded.clips {
            let clip = arguments.select_tracks(clip, path)?;
            let mut one = ShownClip::new(path, clip, loaded.box_length, several);
            note_scalars(&one.name, &one.clip);
            if one.clip.set.is_empty() {
                words::note(&format!("{}: nothing moves; it is left out", one.name));
                continue;
            }
            match document
                .as_ref()
                .map(|document| document.carried_mesh(&one.clip))
            {
                Some(Ok(mesh)) => one.mesh = mesh.filter(|mesh| is_small(mesh, &one.name)),
                Some(Err(fault)) => {
                    words::warning(&format!("{fault}; bones are shown without meshes"));
                }
                None => {}
            }
            shown.push(arguments.sampled(one)?);
        }
        Ok(())
    };
    // If an input fails, the page is still written for the others.
    let outcome = for_each(&inputs, |path| {
        read(path).inspect_err(|failure| failed.push(InputEntry::failed(path, None, failure)))
    });
    if shown.is_empty() {
        outcome.clone()?;
    }
    arguments.check_effects(&shown)?;
    tell_apart(&mut shown);
    let found = find_ghosts(&shown);
    match arguments.no_ghosts {
        true => arguments.check_ghosts(&found, inputs.len())?,
        false => found.give(&mut shown),
    }
    let methods = arguments.methods(&shown)?;
    let mut device = arguments.device.open()?;
    let menu = if inputs.len() > 1 {
        "Input"
    } else {
        "Animation"
    };
    let text = arguments.page(&mut shown, &methods, menu, &mut device)?;
    destination.write(None, |out| out.write_all(text.as_bytes()))?;
    if arguments.json {
        let page = DrawnFile::new(
            &inputs,
            destination.path(),
            &device.label,
            WarningMark::default(),
        );
        listing::records(&[page], &failed)?;
    }
    words::note(&format!(
        "{}, {}, on {}, {} → {destination}",
        words::count(inputs.len(), "input"),
        counted_choices(&methods),
        device.label,
        words::bytes(text.len() as f64),
    ));
    if arguments.open {
        open::that_detached(destination.path()).map_err(|_| {
            let message = format!(
                "{destination} is written, but no browser could be started; open the file in one"
            );
            Failure::new(OUTPUT, message)
        })?;
    }
    match refused {
        0 => outcome,
        _ => {
            let all = words::count(refused + shown.len(), "animation");
            let message = format!("{refused} of {all} could not be read; the others are shown");
            Err(Failure::new(SOME_INPUTS, message))
        }
    }
}

impl Arguments {
    /// Refuses options that have no effect on any of the inputs.
    fn check_effects(&self, shown: &[ShownClip]) -> Result<(), Failure> {
        let line = &self.command_line;
        if !shown.iter().any(|one| one.path.is_some()) {
            PathArguments::refuse(line, "files of rotations")?;
        }
        if !shown.is_empty() && shown.iter().all(|one| one.path.is_some()) {
            line.refuse_rotation_options("files of paths")?;
        }
        if !shown.iter().any(ShownClip::is_travel) {
            Scenery::refuse(line)?;
        }
        Ok(())
    }

    /// Refuses `--no-ghosts` if there are none.
    fn check_ghosts(&self, found: &FoundGhosts, inputs: usize) -> Result<(), Failure> {
        let on = match inputs {
            _ if !found.is_empty() => return Ok(()),
            1 => "one input",
            _ => "inputs without an animation and a time in common",
        };
        let option = [("no_ghosts", "--no-ghosts")];
        self.command_line.refuse(&option, on, "leave it out")
    }

    /// The clip with the selected tracks and their ancestors: joints, or the boxes of a chain before them.
    fn select_tracks(&self, clip: Motion, path: &Path) -> Result<Motion, Failure> {
        let (name, tracks) = (names::input(path), &self.inputs.tracks);
        if clip.is_chain() {
            return match tracks.chain(&clip, &name)? {
                Some(chain) => selected(&clip, &chain, &name),
                None => Ok(clip),
            };
        }
        Ok(tracks.select_with_ancestors(&clip, &name)?.into_owned())
    }

    /// The page of clips that were read before from a file of this name.
    pub(crate) fn html(
        &self,
        path: &Path,
        clips: Vec<Motion>,
        box_length: Option<f64>,
    ) -> Result<String, Failure> {
        let several = clips.len() > 1;
        let shown: Result<Vec<ShownClip>, Failure> = clips
            .into_iter()
            .map(|clip| ShownClip::new(path, clip, box_length, several))
            .filter(|one| !one.clip.set.is_empty())
            .map(|one| self.sampled(one))
            .collect();
        let mut shown = shown?;
        let methods = self.methods(&shown)?;
        self.page(&mut shown, &methods, "Animation", &mut self.device.open()?)
    }

    fn destination(&self, inputs: &[PathBuf]) -> Result<Destination, Failure> {
        if let Some(out) = &self.out {
            target::refuse_both_on_standard(self.json, out)?;
        }
        let Some(out) = &self.out else {
            // A unique name; the file stays for the browser.
            let name = format!("tumble-view-{:016x}.html", fastrand::u64(..));
            return Destination::new(&std::env::temp_dir().join(name), false, inputs);
        };
        if names::is_standard(out) && self.open {
            return Err(Failure::usage(
                "standard output cannot be opened in a browser",
            ));
        }
        Destination::new(out, self.overwrite, inputs)
    }

    /// The methods of each clip: the requested ones; otherwise all, or the common ones if all would make a large page.
    fn methods(&self, shown: &[ShownClip]) -> Result<Vec<Vec<ResultChoice>>, Failure> {
        if shown.is_empty() {
            return Err(Failure::usage("there is nothing to show: nothing moves"));
        }
        let choices_by = |methods: &[MethodChoice]| -> Vec<Vec<ResultChoice>> {
            shown.iter().map(|one| one.methods(methods)).collect()
        };
        let asked = each_once(self.methods.iter().flat_map(|selection| &selection.0));
        if asked.is_empty() {
            let common = ["bessel-overhauser", "slerp", "catmull-rom", "b-spline"];
            let mut first = vec![MethodChoice(None)];
            first.extend(common.map(|name| MethodChoice(Method::named(name))));
            let all: Vec<MethodChoice> = first.iter().copied().chain(MethodChoice::all()).collect();
            let all = choices_by(&each_once(all.iter()));
            return match bytes(shown, &all) <= SMALL_PAGE_BYTES {
                true => Ok(all),
                false => fitting(shown, choices_by(&first)),
            };
        }
        fitting(shown, choices_by(&asked))
    }

    /// The samples that are shown: the frames and, if there are not many more, the keys between them, so that keys are
    /// shown exactly.
    fn sampled(&self, one: ShownClip) -> Result<ShownClip, Failure> {
        let (name, outside) = (&one.name, self.interpolation.outside());
        let frames = in_frames(self.fps, [self.start, self.end], &one.clip, outside, name)?;
        let timeline = one.timeline(&frames)?;
        if one.bytes(timeline.len()) > MAX_PAGE_BYTES {
            return Err(Failure::usage(format!(
                "{name}: {} × {} are more than a page can hold; ask for fewer frames (--fps, \
                 --start, --end)",
                one.tracks(),
                words::count(timeline.len(), "frame")
            )));
        }
        let mut times: Vec<f64> = timeline.times(0).collect();
        let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
            return Err(Failure::usage(format!(
                "{name}: there are no frames to show"
            )));
        };
        let span = one.clip.set.time_span();
        let end = self.end.map(|end| one.clip.time_in_set(end));
        let end = end.or(span.map(|span| span.1)).unwrap_or(last);
        let mut keys = one.key_times();
        keys.retain(|&key| key >= first && key <= end);
        if keys.len() <= times.len() {
            times.extend(keys);
            times.sort_by(f64::total_cmp);
            times.dedup();
        }
        Ok(ShownClip { times, ..one })
    }

    /// The page of all clips, each by its methods. `menu`: the label of the menu of clips.
    fn page(
        &self,
        shown: &mut [ShownClip],
        methods: &[Vec<ResultChoice>],
        menu: &'static str,
        device: &mut OpenedDevice,
    ) -> Result<String, Failure> {
        let results: usize = methods.iter().map(Vec::len).sum();
        let mut progress = Progress::new("evaluating", results as u64);
        let mut sets = Vec::new();
        for (one, choices) in shown.iter_mut().zip(methods) {
            let mut results = Vec::new();
            for &choice in choices {
                results.push(one.result(choice, self.interpolation, device)?);
                progress.advance(1);
            }
            if let Some(&first) = choices.first() {
                one.give_keys(first, device)?;
            }
            sets.push(StoredSet::new(
                one,
                results,
                &self.scenery,
                !self.frames_only,
            ));
        }
        drop(progress);
        let meshes = self.scenery.read()?;
        // The animations of a file usually move the same mesh, so it is stored once.
        let mut skins: Vec<&CarriedMesh> = Vec::new();
        for (one, set) in shown.iter().zip(&mut sets) {
            if let Some(mesh) = &one.mesh {
                let known = skins.iter().position(|&known| known == mesh);
                set.skin = Some(known.unwrap_or(skins.len()));
                if known.is_none() {
                    skins.push(mesh);
                }
            }
        }
        let methods = methods.concat();
        let page = Page::new(
            &methods,
            sets,
            &meshes,
            &skins,
            menu,
            &device.label,
            self.interpolation,
        );
        Ok(page.html())
    }
}

/// Gives clips of inputs of the same name in different folders titles with the folders.
fn tell_apart(shown: &mut [ShownClip]) {
    let titles = shown
        .iter()
        .map(|one| (one.file.clone(), one.title.clone()));
    let titles: Vec<(PathBuf, String)> = titles.collect();
    for one in shown {
        let is_same = |(file, title): &(PathBuf, String)| *file != one.file && *title == one.title;
        if titles.iter().any(is_same) {
            one.title.clone_from(&one.name);
        }
    }
}

/// Whether a page can hold a mesh.
fn is_small(mesh: &CarriedMesh, name: &str) -> bool {
    let vertices = mesh.positions.len();
    let bytes = vertices * 28 + mesh.triangles.len() * 12;
    if bytes as f64 > SMALL_PAGE_BYTES {
        words::note(&format!(
            "{name}: {vertices} vertices are more than a page shows well; bones are shown without meshes"
        ));
    }
    bytes as f64 <= SMALL_PAGE_BYTES
}

/// Bytes of all results before they are packed.
fn bytes(shown: &[ShownClip], methods: &[Vec<ResultChoice>]) -> f64 {
    let of_each = shown.iter().zip(methods);
    of_each
        .map(|(one, choices)| choices.len() as f64 * one.bytes(one.times.len()))
        .sum()
}

/// `authored and 15 methods`: `authored` is not counted as a method, because it stands for the methods of the file.
fn counted_choices(methods: &[Vec<ResultChoice>]) -> String {
    let choices = each_once(methods.iter().flatten());
    let is_authored = |choice: &ResultChoice| *choice == ResultChoice::By(MethodChoice::AUTHORED);
    let named = choices
        .iter()
        .filter(|&choice| !is_authored(choice))
        .count();
    let counted = words::count(named, "method");
    match (named, named < choices.len()) {
        (0, true) => "authored".to_owned(),
        (_, true) => format!("authored and {counted}"),
        (_, false) => counted,
    }
}

/// The methods of each clip, if a page can hold the results.
fn fitting(
    shown: &[ShownClip],
    methods: Vec<Vec<ResultChoice>>,
) -> Result<Vec<Vec<ResultChoice>>, Failure> {
    let bytes = bytes(shown, &methods);
    if bytes <= MAX_PAGE_BYTES {
        return Ok(methods);
    }
    let rotations: f64 = shown.iter().map(|one| one.rotations(one.times.len())).sum();
    Err(Failure::usage(format!(
        "{} by {} are {}, more than the {} that a page can hold; ask for fewer methods (-m), \
         fewer frames (--fps, --start, --end) or fewer inputs",
        words::count(rotations as usize, "rotation"),
        counted_choices(&methods),
        words::bytes(bytes),
        words::bytes(MAX_PAGE_BYTES),
    )))
}
