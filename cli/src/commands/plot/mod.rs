//! `tumble plot`: pictures of interpolated keys, and of bodies on paths.

pub(crate) mod draw;
pub(crate) mod figure;
mod path;
pub(crate) mod report;
pub(crate) mod source;
pub(crate) mod sphere;
mod subjects;

use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use glam::Vec3;
use tumble::{TrackSet, method};
use tumble_formats::folder::Folder;
use tumble_formats::motion::Motion;

use crate::arguments::device::{DeviceArguments, OpenedDevice};
use crate::arguments::input::{self, Inputs};
use crate::arguments::interpolation::{
    CurveChoice, InterpolationArguments, MethodArgumentSelection, curve_warning, each_once,
    method_arguments,
};
use crate::arguments::options::CommandLine;
use crate::arguments::path::{PATHS, PathArguments};
use crate::arguments::time::SamplingArguments;
use crate::arguments::tracks::ScalarArguments;
use crate::batch::entry::InputEntry;
use crate::batch::target::{self, Destination};
use crate::commands::plot::figure::Figure;
use crate::commands::plot::source::curves::PlotSubject;
use crate::commands::plot::source::{PlotSamples, PlotSource};
use crate::commands::plot::subjects::{
    ComponentSelector, PlotQuantity, Subjects, changing_scalars, moving_boxes, together,
};
use crate::commands::travel::{self, Maker, is_path_file, is_travel};
use crate::messages::drawn::{DrawnFile, check_has_tracks, note_scalars};
use crate::messages::exit::{Failure, for_each};
use crate::messages::progress::Progress;
use crate::messages::warnings::{self, WarningMark};
use crate::messages::{listing, names, words};
use tumble_formats::sample::MethodChoice;

/// Plot rotations (components, angular speed, error, an axis on a sphere), scalars, or bodies on paths, as SVG or PNG
#[derive(Debug, Args)]
#[command(after_help = "\
Keys are drawn as dots, or as vertical lines where a curve has no value at a key. Tracks that never \
turn and scalars that never change are left out unless they are chosen (--tracks, --scalars). For files of paths, the speed, \
the angular speed of the direction and the roll are drawn for each --path-frame.

Examples:
  tumble plot data/pendulum.dat -o pendulum.svg
  tumble plot data/pendulum.dat --components 0.x,3.z -m slerp,c2 -o two.png
  tumble plot data/pendulum.dat --show speed -m slerp,catmull-rom,c2 -o speed.svg
  tumble plot data/pendulum.dat --show error --tracks 3 -m all -o error.svg
  tumble plot lafan1/walk.csv --robot g1.xml --show scalars --scalars '*elbow' -o elbows.svg
  tumble plot data/*.dat -o pictures           a picture for each box of each input
  tumble plot road.csv --path-frame minimal,frenet -o road.svg
  tumble plot --report data/pendulum.dat data/pendulum-random.dat -o report")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    #[command(flatten)]
    inputs: Inputs,
    /// Where to write: FILE.svg, FILE.png, or a directory for several pictures
    #[arg(short, long = "output", alias = "out", value_name = "OUT")]
    out: PathBuf,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Print JSON: about the pictures and the inputs that failed
    #[arg(long)]
    json: bool,
    /// How to interpolate: one method or several, or all [default: authored; for a report
    /// slerp,catmull-rom,bessel-overhauser]
    #[arg(short, long = "method", value_name = "METHODS", value_delimiter = ',', value_parser = method_arguments())]
    methods: Vec<MethodArgumentSelection>,
    /// What to draw [default: components; of files of paths, path]
    #[arg(long, value_enum, value_name = "WHAT")]
    show: Option<PlotQuantity>,
    /// Draw only these components of rotations, such as `knee.x`: a track (its name, or its index from 0) and w, x, y
    /// or z; `tumble info --json` lists the tracks
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        conflicts_with = "tracks"
    )]
    components: Vec<ComponentSelector>,
    #[command(flatten)]
    scalars: ScalarArguments,
    /// Only this dimension, counted from 1: w x y z of the first track, then of the second …
    #[arg(
        long = "dimension",
        value_name = "D",
        value_delimiter = ',',
        hide = true,
        conflicts_with_all = ["components", "boxes", "tracks"]
    )]
    dimensions: Vec<usize>,
    /// Only this track, counted from 1
    #[arg(
        long = "box",
        value_name = "N",
        value_delimiter = ',',
        hide = true,
        conflicts_with_all = ["components", "tracks"]
    )]
    boxes: Vec<usize>,
    /// sphere: the axis of the box to draw; -y points along the box
    #[arg(long, value_enum, default_value = "-y", allow_hyphen_values = true)]
    axis: AxisArgument,
    /// Write a report: all plots, and an HTML page that shows them, into a directory
    #[arg(long, conflicts_with_all = ["show", "components", "dimensions", "boxes", "tracks", "axis", "scalars"])]
    report: bool,
    /// The format of the results: svg or png [default: by the name of the output, else svg]
    #[arg(long, visible_alias = "to", alias = "picture-format", value_enum)]
    format: Option<PictureFormat>,
    #[command(flatten)]
    sampling: SamplingArguments,
    #[command(flatten, next_help_heading = PATHS)]
    path: PathArguments,
    #[command(flatten)]
    interpolation: InterpolationArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum AxisArgument {
    X,
    Y,
    Z,
    #[value(name = "-x")]
    MinusX,
    #[value(name = "-y")]
    MinusY,
    #[value(name = "-z")]
    MinusZ,
}

impl From<AxisArgument> for Vec3 {
    fn from(axis: AxisArgument) -> Self {
        match axis {
            AxisArgument::X => Self::X,
            AxisArgument::Y => Self::Y,
            AxisArgument::Z => Self::Z,
            AxisArgument::MinusX => Self::NEG_X,
            AxisArgument::MinusY => Self::NEG_Y,
            AxisArgument::MinusZ => Self::NEG_Z,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PictureFormat {
    /// drawn with lines and letters
    Svg,
    /// drawn with pixels, two for each of SVG's
    Png,
}

impl PictureFormat {
    fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_lowercase().as_str() {
            "svg" => Some(Self::Svg),
            "png" => Some(Self::Png),
            _ => None,
        }
    }

    fn extension(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
        }
    }
}

/// Bodies on paths, their makers, and the failure of animations that were refused.
type Bodies = (travel::TravelSource, Vec<Maker>, Result<(), Failure>);

/// The output of pictures.
enum PlotOutput {
    One(PathBuf),
    Folder(Folder),
}

/// Says where curves are less smooth than their methods promise.
fn note_curves(name: &str, clip: &Motion, choices: &[CurveChoice]) {
    // Only methods that the user named, because no file states a method that causes these warnings.
    let named = choices.iter().filter_map(|choice| choice.method.0);
    let interpolations = named.map(|method| choices[0].interpolation(method));
    let warnings = interpolations.filter_map(|one| curve_warning(name, clip, &one));
    warnings.for_each(words::warn_of);
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = arguments
        .inputs
        .distinct(arguments.sampling.reads_standard_input())?;
    let samples = PlotSamples {
        request: arguments.sampling.samples()?,
        is_rate_chosen: arguments.command_line.has("fps"),
        outside: arguments.interpolation.outside(),
    };
    arguments.check_effects(&inputs)?;
    let out = arguments.output(&inputs)?;
    let mut writer = FigureWriter {
        device: arguments.device.open()?,
        format: arguments.format(),
        out,
        overwrite: arguments.overwrite,
        stems: names::distinct_stems(&inputs),
        titles: names::distinct_files(&inputs),
        inputs: inputs.clone(),
        drawn: Vec::new(),
        mark: warnings::mark(),
    };
    if arguments.report {
        return report::write(arguments, &mut writer, &samples);
    }
    let outcome = arguments.for_each_input(&inputs, &mut writer, |writer, path| {
        let name = names::input(path);
        let stem = writer.stem(path);
        if let Some((source, makers, rest)) = arguments.bodies(path)? {
            let title = (&*name, writer.title(path));
            let figure = path::figure(&mut writer.device, title, &source, &makers)?;
            let file = format!("{stem}-path.{}", writer.format.extension());
            return writer.draw(&figure, &file, path).and(rest);
        }
        let input::OnlyClip { clip, rest, .. } = arguments.inputs.load_one(path)?;
        let choices = arguments.choices(&name, &clip)?;
        note_curves(&name, &clip, &choices);
        let title = names::clip_title(&writer.title(path), &clip);
        let source = PlotSource::new(title, &clip, &choices, &samples)?;
        let subjects = match arguments.show() {
            PlotQuantity::Scalars => arguments.scalars(&clip, &name)?,
            _ => {
                check_has_tracks(&name, &clip, "--show scalars draws them")?;
                note_scalars(&name, &clip);
                let tracks = arguments.inputs.tracks.of(&clip, &name)?;
                arguments.subjects(&clip.set, tracks, &name)?
            }
        };
        let pictures = match &writer.out {
            PlotOutput::One(_) => {
                vec![(String::new(), together(&subjects, choices.len(), &name)?)]
            }
            PlotOutput::Folder(_) => {
                let file = |(label, subject): (String, PlotSubject)| {
                    let name = format!("{stem}-{label}.{}", writer.format.extension());
                    (name, subject)
                };
                subjects.each().into_iter().map(file).collect()
            }
        };
        let mut progress = Progress::new("drawing", pictures.len() as u64);
        for (file, subject) in pictures {
            let figure = source.figure(&mut writer.device, &subject)?;
            writer.draw(&figure, &file, path)?;
            progress.advance(1);
        }
        rest
    });
    if writer.drawn.is_empty() {
        return outcome;
    }
    words::note(&format!(
        "{} of {}, on {} → {}",
        words::count(writer.drawn.len(), "picture"),
        words::count(inputs.len(), "input"),
        writer.device.label,
        arguments.out.display()
    ));
    outcome
}

impl Arguments {
    fn methods(&self) -> Vec<MethodChoice> {
        let methods = each_once(self.methods.iter().flat_map(|selection| &selection.0));
        match (methods.is_empty(), self.report) {
            (false, _) => methods,
            (true, false) => vec![MethodChoice(None)],
            (true, true) => [
                method::SLERP,
                method::CATMULL_ROM,
                method::BESSEL_OVERHAUSER,
            ]
            .map(|method| MethodChoice(Some(method)))
            .to_vec(),
        }
    }

    /// Draws each input, and prints JSON about the pictures and the inputs that failed.
    fn for_each_input(
        &self,
        inputs: &[PathBuf],
        writer: &mut FigureWriter,
        mut draw: impl FnMut(&mut FigureWriter, &PathBuf) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let mut failed = Vec::new();
        let outcome = for_each(inputs, |path| {
            let drawn = draw(writer, path);
            drawn.inspect_err(|failure| failed.push(InputEntry::failed(path, None, failure)))
        });
        if self.json {
            listing::records(&writer.drawn, &failed)?;
        }
        outcome
    }

    /// The methods that draw a clip, each differently.
    fn choices(&self, name: &str, clip: &Motion) -> Result<Vec<CurveChoice>, Failure> {
        if self.show() == PlotQuantity::Scalars {
            return CurveChoice::of_scalars(&self.methods(), self.interpolation, name);
        }
        CurveChoice::of_clip(&self.methods(), self.interpolation, name, clip)
    }

    /// Refuses options that have no effect on the pictures of these inputs.
    fn check_effects(&self, inputs: &[PathBuf]) -> Result<(), Failure> {
        let line = &self.command_line;
        let path_files = inputs.iter().filter(|path| is_path_file(path)).count();
        if path_files == 0 {
            PathArguments::refuse(line, "files of rotations")?;
        }
        if path_files == inputs.len() {
            line.refuse_rotation_options("files of paths")?;
        }
        let is_path = match self.show {
            Some(show) => show == PlotQuantity::Path,
            None => path_files == inputs.len(),
        };
        if is_path {
            let (on, remedy) = (
                "pictures of paths",
                "each is drawn from its first key to its last; leave it out",
            );
            line.refuse_group::<SamplingArguments>(on, remedy)?;
            let subjects = [
                ("components", "--components"),
                ("boxes", "--box"),
                ("dimensions", "--dimension"),
            ];
            line.refuse(&subjects, on, remedy)?;
        }
        if self.show == Some(PlotQuantity::Scalars) {
            let remedy = "choose scalars by --scalars, or leave it out";
            let tracks = [("tracks", "--tracks"), ("boxes", "--box")];
            line.refuse(&tracks, "plots of scalars", remedy)?;
        } else {
            let remedy = "add --show scalars, or leave it out";
            line.refuse(&[("scalars", "--scalars")], "this plot", remedy)?;
        }
        if self.show != Some(PlotQuantity::Sphere) {
            let remedy = "add --show sphere, or leave it out";
            line.refuse(&[("axis", "--axis")], "this plot", remedy)?;
        }
        Ok(())
    }

    fn show(&self) -> PlotQuantity {
        self.show.unwrap_or(PlotQuantity::Components)
    }

    /// The bodies on the paths of a file, if these are to be drawn, their makers, and the failure of
    /// animations that were refused.
    fn bodies(&self, path: &Path) -> Result<Option<Bodies>, Failure> {
        let name = names::input(path);
        match self.show {
            None | Some(PlotQuantity::Path) if is_path_file(path) => {
                let frames = self.path.frames().into_iter().map(Maker::Frame);
                let source = travel::TravelSource::of_paths(path, &self.path, &self.inputs.tracks)?;
                Ok(Some((source, frames.collect(), Ok(()))))
            }
            Some(PlotQuantity::Path) => {
                let input::OnlyClip { clip, rest, .. } = self.inputs.load_one(path)?;
                if !is_travel(&clip) {
                    let message =
                        "is neither a file of paths nor one of moving joints without parents";
                    return Err(Failure::usage(format!("{name}: {message}")));
                }
                let clip = self.inputs.tracks.select(&clip, &name)?.into_owned();
                let methods = self.choices(&name, &clip)?.into_iter().map(Maker::Method);
                let source = travel::TravelSource::Clip(Box::new(clip));
                Ok(Some((source, methods.collect(), rest)))
            }
            Some(_) if is_path_file(path) => Err(Failure::usage(format!(
                "{name}: paths are drawn by --show path; to draw rotations, write them by `tumble follow` first"
            ))),
            _ => Ok(None),
        }
    }

    fn format(&self) -> PictureFormat {
        let named = PictureFormat::of(&self.out);
        self.format.or(named).unwrap_or(PictureFormat::Svg)
    }

    /// Checks the output before any work; makes the directory.
    fn output(&self, inputs: &[PathBuf]) -> Result<PlotOutput, Failure> {
        let out = &self.out;
        target::refuse_both_on_standard(self.json, out)?;
        let shown = out.display();
        let is_file =
            !out.is_dir() && (PictureFormat::of(out).is_some() || names::is_standard(out));
        if !is_file {
            if out.extension().is_some() && !out.is_dir() {
                return Err(Failure::usage(format!(
                    "{shown}: end the picture in .svg or .png, or give a directory"
                )));
            }
            return Ok(PlotOutput::Folder(target::open_folder(out)?));
        }
        if self.report {
            return Err(Failure::usage(format!(
                "{shown}: a report has many pictures; give a directory"
            )));
        }
        if inputs.len() > 1 {
            return Err(Failure::usage(format!(
                "{shown}: several inputs need a directory for their pictures, not one file"
            )));
        }
        Destination::new(out, self.overwrite, inputs)?.check_writable()?;
        Ok(PlotOutput::One(out.clone()))
    }

    /// The scalars to draw of a clip.
    fn scalars(&self, clip: &Motion, name: &str) -> Result<Subjects, Failure> {
        if !self.dimensions.is_empty() || !self.components.is_empty() {
            return Err(Failure::usage(COMPONENTS_ALONE));
        }
        if clip.set.scalar_count() == 0 {
            return Err(Failure::usage(format!(
                "{name}: has no scalars, such as the joints of a robot; leave out --show scalars"
            )));
        }
        let chosen = self.scalars.of(clip, name)?;
        Ok(Subjects {
            boxes: chosen.unwrap_or_else(|| changing_scalars(clip, name)),
            dimensions: Vec::new(),
            show: PlotQuantity::Scalars,
            axis: self.axis.into(),
        })
    }

    /// The subjects to draw of a set; refuses boxes and dimensions that do not exist.
    fn subjects(
        &self,
        set: &TrackSet,
        tracks: Option<Vec<usize>>,
        name: &str,
    ) -> Result<Subjects, Failure> {
        let boxes = set.track_count();
        let is_of_components = !self.dimensions.is_empty() || !self.components.is_empty();
        if is_of_components && self.show() != PlotQuantity::Components {
            return Err(Failure::usage(COMPONENTS_ALONE));
        }
        let there = format!(
            "{name} has {}, dimensions 1 to {} (w x y z of box 1, then of box 2 …)",
            words::boxes(boxes),
            4 * boxes
        );
        let chosen = |label: &str, requested: &[usize], all: Range<usize>| {
            let wrong = requested
                .iter()
                .find(|&&number| number == 0 || number > all.end);
            match wrong {
                Some(number) => Err(Failure::usage(format!(
                    "there is no {label} {number}: {there}"
                ))),
                None => Ok(requested
                    .iter()
                    .map(|number| number - 1)
                    .collect::<Vec<_>>()),
            }
        };
        let mut dimensions = chosen("dimension", &self.dimensions, 0..4 * boxes)?;
        for component in &self.components {
            dimensions.push(component.dimension(set, name)?);
        }
        let mut selected = chosen("box", &self.boxes, 0..boxes)?;
        if selected.is_empty() && dimensions.is_empty() {
            selected = tracks.unwrap_or_else(|| moving_boxes(set, name));
        }
        Ok(Subjects {
            boxes: selected,
            dimensions,
            show: self.show(),
            axis: self.axis.into(),
        })
    }
}

const COMPONENTS_ALONE: &str = "--components needs --show components; choose tracks or scalars for the others (--tracks, --scalars)";

/// Draws figures into files.
pub(crate) struct FigureWriter {
    device: OpenedDevice,
    format: PictureFormat,
    out: PlotOutput,
    overwrite: bool,
    inputs: Vec<PathBuf>,
    /// The names of the pictures of each input.
    stems: Vec<String>,
    /// The name of each input in titles.
    titles: Vec<String>,
    drawn: Vec<DrawnFile>,
    /// When the work on the inputs began.
    mark: WarningMark,
}

impl FigureWriter {
    /// Where the picture, or page, of that name goes; a single picture has the name that was given.
    fn destination(&self, name: &str) -> Result<Destination, Failure> {
        match &self.out {
            PlotOutput::One(file) => Destination::new(file, self.overwrite, &self.inputs),
            PlotOutput::Folder(folder) => {
                Destination::below(folder, Path::new(name), self.overwrite, &self.inputs)
            }
        }
    }

    /// The name of an input, with which the names of its pictures begin.
    fn stem(&self, path: &Path) -> String {
        let index = self.inputs.iter().position(|input| input == path);
        index.map_or_else(|| names::stem(path), |index| self.stems[index].clone())
    }

    /// The name of an input in titles.
    fn title(&self, path: &Path) -> String {
        let index = self.inputs.iter().position(|input| input == path);
        index.map_or_else(|| names::file(path), |index| self.titles[index].clone())
    }

    /// Draws a figure of an input.
    fn draw(&mut self, figure: &Figure, name: &str, input: &Path) -> Result<(), Failure> {
        let drawn = match self.format {
            PictureFormat::Svg => draw::svg(figure).map(String::into_bytes),
            PictureFormat::Png => draw::png(figure),
        };
        let destination = self.destination(name)?;
        let bytes = drawn.map_err(|error| Failure::writing(&destination.to_string(), &error))?;
        destination.write(None, |out| out.write_all(&bytes))?;
        let device = &self.device.label;
        let inputs = [input.to_owned()];
        (self.drawn).push(DrawnFile::new(
            &inputs,
            destination.path(),
            device,
            self.mark,
        ));
        Ok(())
    }
}
