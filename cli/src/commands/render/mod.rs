//! `tumble render`: boxes, skeletons and bodies on paths drawn to pictures and films, without a display.

mod actors;
mod bones;
pub(crate) mod film;
pub(crate) mod scene;
pub(crate) mod solids;
mod typical_body;

use std::io;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use tumble::{SampleTimes, Timeline};
use tumble_formats::carried_mesh::CarriedMesh;

use crate::arguments::device::{DeviceArguments, OpenedDevice};
use crate::arguments::input::{self, Inputs};
use crate::arguments::interpolation::{
    CurveChoice, InterpolationArguments, MethodArgumentSelection, each_once, method_arguments,
};
use crate::arguments::options::CommandLine;
use crate::arguments::path::{PATHS, PathArguments};
use crate::arguments::time::SamplingArguments;
use crate::arguments::tracks::selected;
use crate::batch::room;
use crate::batch::target::{self, Destination};
use crate::commands::picture;
use crate::commands::render::actors::Subject;
use crate::commands::render::film::Picture;
use crate::commands::render::film::apng::Apng;
use crate::commands::render::film::gif::Gif;
use crate::commands::render::scene::{Actor, CameraView, Scene, Style, Surroundings, Theme};
use crate::commands::travel::{Maker, Scenery, TravelSource, is_path_file, is_travel};
use crate::messages::drawn::{DrawnFile, check_has_tracks, note_scalars};
use crate::messages::exit::Failure;
use crate::messages::progress::Progress;
use crate::messages::warnings::WarningMark;
use crate::messages::{listing, names, signals, words};
use tumble_formats::sample::MethodChoice;

/// Chains side by side in one picture.
const MAX_METHODS: usize = 4;

/// The shortest time for which browsers show a frame of a GIF, seconds; less some rounding.
const SHORTEST_IN_GIF: f64 = 0.02 - 1e-9;

/// Draw boxes, skeletons or bodies on paths as images or an animation, without a display
#[derive(Debug, Args)]
#[command(after_help = "\
Skeletons are drawn as bones, at their offsets and translations, or as the mesh of a glTF file that they \
move. Tracks without positions are the boxes of a chain. If the input is a file of paths, or \
a motion file in which all joints are roots that move (as written by `tumble follow`), the path is drawn, \
with its frames as small axes (x red, y green, z blue) and a box on it.

Examples:
  tumble render data/pendulum.dat -o pendulum.gif
  tumble render data/pendulum.dat -m slerp,bessel-overhauser --size 800x400 -o both.apng
  tumble render data/pendulum.dat --start 2.5 -o still.png
  tumble render data/pendulum.dat --fps 60 -o frames    frames/00000.png, 00001.png …
  tumble render walk.bvh --size 400x600 --view 60,10 -o walk.gif
  tumble render road.csv --path-frame frenet,minimal -o both.gif
  tumble render walker.glb --mesh hill.obj,rocks.obj --view 30,25 -o walk.gif")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    /// A keyframe file, or one of paths (`-`: standard input)
    #[command(flatten)]
    inputs: Inputs,
    /// Where to write: FILE.gif, FILE.apng, FILE.png (the first frame), or a directory for a
    /// picture of each frame
    #[arg(short, long = "output", alias = "out", value_name = "OUT")]
    out: PathBuf,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Print JSON: about the film or the pictures
    #[arg(long)]
    json: bool,
    /// How to interpolate: one method or several, which stand side by side
    #[arg(
        short,
        long = "method",
        value_name = "METHODS",
        value_delimiter = ',',
        default_value = "authored",
        value_parser = method_arguments()
    )]
    methods: Vec<MethodArgumentSelection>,
    /// Width and height of a picture, pixels
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = size)]
    size: (u32, u32),
    /// The camera's direction: degrees about the vertical axis, and above the floor
    #[arg(long, value_name = "AROUND,ABOVE", default_value = "23,17", value_parser = view, allow_hyphen_values = true)]
    view: CameraView,
    /// The colours of background and floor
    #[arg(long, value_enum, default_value = "light")]
    theme: ThemeArgument,
    #[command(flatten, next_help_heading = PATHS)]
    scenery: Scenery,
    #[command(flatten, next_help_heading = PATHS)]
    path: PathArguments,
    #[command(flatten)]
    sampling: SamplingArguments,
    #[command(flatten)]
    interpolation: InterpolationArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ThemeArgument {
    Light,
    Dark,
}

impl From<ThemeArgument> for Theme {
    fn from(theme: ThemeArgument) -> Self {
        match theme {
            ThemeArgument::Light => Self::LIGHT,
            ThemeArgument::Dark => Self::DARK,
        }
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', '×']);
    let parsed =
        sides.and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    match parsed {
        Some((width @ 16..=4096, height @ 16..=4096)) => Ok((width, height)),
        _ => Err(format!(
            "invalid size `{text}`: expected WIDTHxHEIGHT in pixels, such as 640x480, each from 16 to 4096"
        )),
    }
}

fn view(text: &str) -> Result<CameraView, String> {
    let angles = text.split_once(',');
    let parsed = angles.and_then(|(around, above)| {
        Some((
            around.trim().parse::<f32>().ok()?,
            above.trim().parse::<f32>().ok()?,
        ))
    });
    match parsed {
        Some((around, above)) if around.is_finite() && (-89.0..=89.0).contains(&above) => {
            Ok(CameraView { around, above })
        }
        _ => Err(format!(
            "invalid view `{text}`: expected two angles in degrees, such as 23,17, the second from -89 to 89"
        )),
    }
}

/// The form of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RenderOutput {
    Gif,
    Apng,
    Still,
    Folder,
}

impl RenderOutput {
    fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        match extension.map(str::to_lowercase).as_deref() {
            _ if path.is_dir() => Ok(Self::Folder),
            Some("gif") => Ok(Self::Gif),
            Some("apng") => Ok(Self::Apng),
            Some("png") => Ok(Self::Still),
            None if !names::is_standard(path) => Ok(Self::Folder),
            _ => Err(Failure::usage(format!(
                "{}: unknown ending; give .gif or .apng for a film, .png for a picture, or a directory",
                path.display()
            ))),
        }
    }
}

/// The actors of a file, and the failure of animations that were refused.
struct Input {
    source: TravelSource,
    /// The mesh that the clip's joints move.
    mesh: Option<CarriedMesh>,
    rest: Result<(), Failure>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = arguments
        .inputs
        .distinct(arguments.sampling.reads_standard_input())?;
    let [path] = &inputs[..] else {
        return Err(Failure::usage("`render` takes a single input"));
    };
    let samples = arguments.sampling.samples()?;
    let methods = each_once(arguments.methods.iter().flat_map(|selection| &selection.0));
    if methods.len() > MAX_METHODS {
        return Err(Failure::usage(format!(
            "{} are too many for one picture, at most {MAX_METHODS}; choose some (-m)",
            words::count(methods.len(), "method")
        )));
    }
    let kind = RenderOutput::of(&arguments.out)?;
    if kind != RenderOutput::Folder {
        Destination::new(&arguments.out, arguments.overwrite, &inputs)?.check_writable()?;
    }
    let name = names::input(path);
    let Input { source, mesh, rest } = arguments.source(path, &name)?;
    arguments.check_effects(&source, kind)?;
    let choices = arguments.choices(&name, &source, methods)?;
    let set = source.set();
    let mut frames = samples.of(source.clip(), arguments.interpolation.outside(), &name)?;
    let mut timeline = frames
        .resolve(set.track_count(), set.time_span())
        .map_err(|error| Failure::evaluating(&name, &error.into()))?;
    if timeline.is_empty() {
        return Err(Failure::usage(format!(
            "{name}: there are no frames to render"
        )));
    }
    if kind == RenderOutput::Still {
        frames = SampleTimes::at(timeline.times(0).take(1).collect());
        timeline = frames
            .resolve(set.track_count(), set.time_span())
            .map_err(|error| Failure::evaluating(&name, &error.into()))?;
    }
    // The rotations, and twice the size of their results, for each method.
    room::in_memory(&name, set, &frames, 5 * choices.len().max(1))?;
    let mut device = arguments.device.open()?;
    let style = Style {
        size: arguments.size,
        view: arguments.view,
        theme: arguments.theme.into(),
    };
    let subject = match &source {
        TravelSource::Clip(clip) if !is_travel(clip) => {
            Some(Subject::new((**clip).clone(), mesh, &name)?)
        }
        _ => None,
    };
    let (actors, surroundings) = match &subject {
        Some(subject) => {
            let actor = |&choice| subject.actor(&mut device, &name, choice, &frames);
            let actors: Vec<Actor> = choices.iter().map(actor).collect::<Result<_, _>>()?;
            let surroundings = subject.surroundings(&actors);
            (actors, surroundings)
        }
        None => arguments.travellers(&mut device, &name, &source, &choices, &frames, style)?,
    };
    let scene = Scene::new(actors, &surroundings, style)
        .map_err(|error| Failure::writing(&arguments.out.display().to_string(), &error))?;
    arguments.render_frames(kind, &scene, &timeline, &inputs)?;
    if arguments.json {
        let film = DrawnFile::new(
            &inputs,
            &arguments.out,
            &device.label,
            WarningMark::default(),
        );
        listing::records(&[film.with_frames(timeline.len())], &[])?;
    }
    words::note(&format!(
        "{name}: {}, {}, on {} → {}",
        words::count(timeline.len(), "frame"),
        match &subject {
            Some(subject) => subject.tracks(),
            None => words::count(set.track_count(), "path"),
        },
        device.label,
        arguments.out.display()
    ));
    rest
}

impl Arguments {
    /// The paths or the clip of a file, with the ancestors of the selected tracks.
    fn source(&self, path: &Path, name: &str) -> Result<Input, Failure> {
        let tracks = &self.inputs.tracks;
        if is_path_file(path) {
            return Ok(Input {
                source: TravelSource::of_paths(path, &self.path, tracks)?,
                mesh: None,
                rest: Ok(()),
            });
        }
        let input::OnlyClip {
            clip,
            document,
            rest,
        } = self.inputs.load_one(path)?;
        check_has_tracks(name, &clip, "`tumble plot --show scalars` draws them")?;
        note_scalars(name, &clip);
        let clip = match clip.is_chain() {
            _ if is_travel(&clip) => tracks.select(&clip, name)?.into_owned(),
            true => match tracks.chain(&clip, name)? {
                Some(chain) => selected(&clip, &chain, name)?,
                None => clip,
            },
            false => tracks.select_with_ancestors(&clip, name)?.into_owned(),
        };
        let mesh = match document.map(|document| document.carried_mesh(&clip)) {
            Some(Ok(mesh)) => mesh,
            Some(Err(fault)) => {
                words::warning(&format!("{fault}; bones are drawn without meshes"));
                None
            }
            None => None,
        };
        Ok(Input {
            source: TravelSource::Clip(Box::new(clip)),
            mesh,
            rest,
        })
    }

    /// Refuses options that have no effect on the picture.
    fn check_effects(&self, source: &TravelSource, kind: RenderOutput) -> Result<(), Failure> {
        let line = &self.command_line;
        match source {
            TravelSource::Paths(..) => {
                line.refuse_rotation_options("a file of paths")?;
            }
            TravelSource::Clip(clip) => {
                PathArguments::refuse(line, "a file of rotations")?;
                if !is_travel(clip) {
                    Scenery::refuse(line)?;
                }
            }
        }
        if kind == RenderOutput::Still {
            let remedy = "it shows the first frame (--start); leave it out, or write a film";
            line.refuse(
                &[("fps", "--fps"), ("end", "--end")],
                "a single picture",
                remedy,
            )?;
        }
        Ok(())
    }

    /// The methods that draw a clip, each differently; none for paths.
    fn choices(
        &self,
        name: &str,
        source: &TravelSource,
        methods: Vec<MethodChoice>,
    ) -> Result<Vec<CurveChoice>, Failure> {
        let TravelSource::Clip(clip) = source else {
            return Ok(Vec::new());
        };
        CurveChoice::of_clip(&methods, self.interpolation, name, clip)
    }

    /// Bodies on paths, by each frame or method.
    fn travellers(
        &self,
        device: &mut OpenedDevice,
        name: &str,
        source: &TravelSource,
        choices: &[CurveChoice],
        frames: &SampleTimes,
        style: Style,
    ) -> Result<(Vec<Actor>, Surroundings), Failure> {
        let makers: Vec<Maker> = match source {
            TravelSource::Paths(..) => self.path.frames().into_iter().map(Maker::Frame).collect(),
            TravelSource::Clip(_) => choices.iter().copied().map(Maker::Method).collect(),
        };
        let of = (source, &*makers);
        actors::travellers(device, name, of, &self.scenery, frames, style.theme.ink)
    }

    /// Draws every frame and writes it.
    fn render_frames(
        &self,
        kind: RenderOutput,
        scene: &Scene,
        timeline: &Timeline,
        inputs: &[PathBuf],
    ) -> Result<(), Failure> {
        let times: Vec<f64> = timeline.times(0).collect();
        let (width, height) = self.size;
        let mut progress = Progress::new("rendering", times.len() as u64);
        let too_fast = times
            .windows(2)
            .any(|pair| pair[1] - pair[0] < SHORTEST_IN_GIF);
        if kind == RenderOutput::Gif && too_fast {
            words::warning(
                "GIF shows no frame for less than 0.02 s, so the film is slower than its keys; \
                 give --fps 50 or less, or write .apng",
            );
        }
        if kind == RenderOutput::Folder {
            let folder = target::open_folder(&self.out)?;
            let digits = (times.len() - 1).to_string().len().max(5);
            let destination = |frame: usize| {
                let name = format!("{frame:0digits$}.png");
                Destination::below(&folder, Path::new(&name), self.overwrite, inputs)
            };
            // Errors in the arguments are reported before any frame is written.
            (0..times.len()).try_for_each(|frame| destination(frame).map(drop))?;
            return scene.each_frame(|frame, pixels| {
                if let Some(stopped) = signals::stopped() {
                    return Err(stopped);
                }
                destination(frame)?.write(None, |out| picture::png(out, width, height, pixels))?;
                progress.advance(1);
                Ok(())
            });
        }
        let file = Destination::new(&self.out, self.overwrite, inputs)?;
        file.write(None, |out| {
            let mut draw = |film: &mut dyn Picture| {
                scene.each_frame(|_, pixels| {
                    progress.advance(1);
                    if signals::stopped().is_some() {
                        return Err(io::Error::other("stopped by a signal"));
                    }
                    film.frame(pixels)
                })
            };
            match kind {
                RenderOutput::Gif => {
                    let mut film = Gif::new(out, self.size, &times, scene.sample_colours())?;
                    draw(&mut film)
                }
                RenderOutput::Apng => {
                    let mut film = Apng::new(out, self.size, &times)?;
                    draw(&mut film)?;
                    film.finish()
                }
                RenderOutput::Still | RenderOutput::Folder => {
                    scene.each_frame(|_, pixels| picture::png(&mut *out, width, height, pixels))
                }
            }
        })
    }
}
