//! `tumble view`: a page that shows the boxes turning, in any browser.

pub(crate) mod pack;
pub(crate) mod page;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use tumble::{Axes, FrameRate, Frames, Interpolation, Layout, METHODS, Method, Quantity, TrackSet};
use tumble_formats::motion::Motion;

use crate::arguments::device::{DeviceArguments, Opened};
use crate::arguments::input::{self, Inputs};
use crate::arguments::interpolation::{Manner, Selection, chosen, methods};
use crate::arguments::time::{finite_seconds, in_frames};
use crate::batch::place::Place;
use crate::batch::room;
use crate::commands::view::page::{Page, StoredResult, StoredSet};
use crate::messages::exit::{Failure, OUTPUT};
use crate::messages::progress::Progress;
use crate::messages::words;

/// Bytes of rotations and speeds that a page may hold, before they are packed.
const LARGEST: f64 = 256e6;
/// With no more than this, every method is shown where none is named.
const SMALL: f64 = 24e6;
/// Bytes of one rotation and its speed.
const SAMPLE: f64 = 10.0;

/// Write a page that shows the boxes turning: one HTML file, for any browser
#[derive(Debug, Args)]
#[command(after_help = "\
The file needs no network and nothing beside it. It shows the engine's own rotations, at
the frames asked for and at the keys between them; it interpolates nothing itself.

Examples:
  tumble view data/pendulum.dat -o pendulum.html
  tumble view data/pendulum.dat --open
  tumble view a.dat b.dat -m slerp,c2 --fps 120 -o both.html")]
pub(crate) struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    /// Where to write (`-`: standard output) [default with --open: a temporary file]
    #[arg(
        short,
        long = "out",
        value_name = "FILE.html",
        required_unless_present = "open"
    )]
    out: Option<PathBuf>,
    /// Replace an existing file
    #[arg(long)]
    overwrite: bool,
    /// Open the page in the browser
    #[arg(long)]
    open: bool,
    /// The methods to choose from, or all; the first is shown first [default: all where the
    /// page stays small, else slerp,catmull-rom,bessel-overhauser,b-spline]
    #[arg(short, long = "method", value_name = "METHODS", value_delimiter = ',', value_parser = methods())]
    methods: Vec<Selection>,
    /// Frames per second, from the first key to the last: a number or a ratio
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
    #[command(flatten)]
    manner: Manner,
    #[command(flatten)]
    device: DeviceArguments,
}

/// One input, and when it is sampled.
struct Shown {
    name: String,
    set: TrackSet,
    box_length: f64,
    times: Vec<f64>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = arguments.inputs.distinct(false)?;
    let place = arguments.place(&inputs)?;
    if !place.is_standard() {
        place.try_out()?;
    }
    let mut shown = Vec::new();
    for path in &inputs {
        let name = input::name(path);
        let loaded = arguments.inputs.load(path)?;
        let box_length = loaded.box_length.unwrap_or(1.0);
        if loaded.clips.len() > 1 {
            return Err(input::several(path, &loaded));
        }
        let Some(Motion { set, .. }) = loaded.clips.into_iter().next() else {
            continue;
        };
        let times = arguments.times(&set, &name)?;
        let name = input::file_name(path);
        shown.push(Shown {
            name,
            set,
            box_length,
            times,
        });
    }
    let rotations: f64 = shown
        .iter()
        .map(|one| one.set.track_count() as f64 * one.times.len() as f64)
        .sum();
    let methods = arguments.methods(rotations);
    let bytes = rotations * methods.len() as f64 * SAMPLE;
    if bytes > LARGEST {
        return Err(Failure::usage(format!(
            "{} by {} are {}, more than the {} that a page can hold; ask for fewer methods (-m), \
             fewer frames (--fps, --start, --end) or fewer inputs",
            words::count(rotations as usize, "rotation"),
            words::count(methods.len(), "method"),
            words::bytes(bytes),
            words::bytes(LARGEST),
        )));
    }
    let mut device = arguments.device.open()?;
    let mut progress = Progress::new("evaluating", (shown.len() * methods.len()) as u64);
    let mut sets = Vec::new();
    for one in &shown {
        sets.push(arguments.stored(one, &methods, &mut device, &mut progress)?);
    }
    drop(progress);
    let page = Page::new(&methods, sets, &device.label);
    let text = page.html();
    place.write(None, |out| out.write_all(text.as_bytes()))?;
    words::note(&format!(
        "{}, {}, on {}, {} → {place}",
        words::count(inputs.len(), "input"),
        words::count(methods.len(), "method"),
        device.label,
        words::bytes(text.len() as f64),
    ));
    if arguments.open {
        open::that_detached(place.path()).map_err(|error| {
            let message = format!("{place}: no browser could be started: {error}; open the file");
            Failure::new(OUTPUT, message)
        })?;
    }
    Ok(())
}

impl Arguments {
    fn place(&self, inputs: &[PathBuf]) -> Result<Place, Failure> {
        let Some(out) = &self.out else {
            // Named after this run, and left there for the browser.
            let name = format!("tumble-view-{}.html", std::process::id());
            return Place::new(&std::env::temp_dir().join(name), true, inputs);
        };
        if input::is_standard(out) && self.open {
            return Err(Failure::usage(
                "standard output cannot be opened in a browser",
            ));
        }
        Place::new(out, self.overwrite, inputs)
    }

    fn methods(&self, rotations: f64) -> Vec<Method> {
        let methods = chosen(&self.methods);
        if !methods.is_empty() {
            return methods;
        }
        let first = ["bessel-overhauser", "slerp", "catmull-rom", "b-spline"];
        let mut methods: Vec<Method> = first.into_iter().filter_map(Method::named).collect();
        if rotations * SAMPLE * METHODS.len() as f64 <= SMALL {
            let others = METHODS
                .iter()
                .filter(|method| !first.contains(&method.name));
            methods.extend(others);
        }
        methods
    }

    /// The frames, and the keys between them where those are not many more: a key is
    /// shown as it is.
    fn times(&self, set: &TrackSet, name: &str) -> Result<Vec<f64>, Failure> {
        let frames = in_frames(self.fps, self.start, self.end, set, name);
        let timeline = frames
            .resolve(set.track_count(), set.time_span())
            .map_err(|error| Failure::evaluating(name, &error.into()))?;
        if set.track_count() as f64 * timeline.len() as f64 * SAMPLE > LARGEST {
            let samples = timeline.len();
            return Err(Failure::usage(format!(
                "{name}: {} × {} are more than a page can hold; ask for fewer frames (--fps, \
                 --start, --end)",
                words::boxes(set.track_count()),
                words::count(samples, "frame")
            )));
        }
        let mut times: Vec<f64> = (0..timeline.len())
            .map(|frame| timeline.time(0, frame))
            .collect();
        let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
            return Err(Failure::usage(format!(
                "{name}: there are no frames to show"
            )));
        };
        let end = self
            .end
            .or(set.time_span().map(|span| span.1))
            .unwrap_or(last);
        let mut keys: Vec<f64> = set
            .tracks()
            .flat_map(|track| track.times.iter().copied())
            .collect();
        keys.retain(|&key| key >= first && key <= end);
        keys.sort_by(f64::total_cmp);
        keys.dedup();
        if keys.len() <= times.len() {
            times.extend(keys);
            times.sort_by(f64::total_cmp);
            times.dedup();
        }
        Ok(times)
    }

    /// One input's results by every method.
    fn stored(
        &self,
        shown: &Shown,
        methods: &[Method],
        device: &mut Opened,
        progress: &mut Progress,
    ) -> Result<StoredSet, Failure> {
        let frames = Frames::at(shown.times.clone());
        room::in_memory(&shown.name, &shown.set, &frames, 2)?;
        let mut results = Vec::new();
        for &method in methods {
            let interpolation = self.manner.with(method);
            let velocity = Interpolation {
                quantity: Quantity::Velocity(Axes::Body),
                ..interpolation
            };
            let mut evaluate = |interpolation| {
                device
                    .collect(&shown.set, interpolation, &frames, Layout::FrameMajor)
                    .map_err(|error| Failure::evaluating(&shown.name, &error))
            };
            let rotations = evaluate(interpolation)?;
            let velocities = evaluate(velocity)?;
            let tracks = shown.set.track_count();
            results.push(StoredResult::new(method, tracks, &rotations, &velocities));
            progress.advance(1);
        }
        Ok(StoredSet::new(
            &shown.name,
            (&shown.set, shown.box_length),
            &shown.times,
            results,
        ))
    }
}
