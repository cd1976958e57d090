//! Results of evaluations: where they go, planned and checked before any work, and
//! how they are written.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::fmt;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use glam::Quat;
use tumble::{Chunk, Encoding, Error, Layout, Timeline, TrackSet};
use tumble_formats::csv::CsvWriter;
use tumble_formats::npy::{ComponentOrder, NpyWriter};
use tumble_formats::output::remove_abandoned;

use crate::arguments::gather::{Found, Gathered};
use crate::arguments::input;
use crate::batch::manifest::Manifest;
use crate::batch::place::{self, Place, Written};
use crate::batch::room;
use crate::batch::stream::Stream;
use crate::messages::exit::Failure;
use crate::messages::progress::Progress;
use crate::messages::signals;

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// `NumPy`'s, float32
    Npy,
    /// text, a row for each frame
    Csv,
}

/// Rotations handed to a writer at once: 4 MB.
const PIECE: usize = 1 << 18;

/// Where one result goes.
#[derive(Debug)]
pub(crate) struct Target {
    place: Place,
    format: Format,
    /// Below the directory of results.
    name: String,
}

/// One target for each input, and the manifest of the directory that they are in.
pub(crate) struct Plan {
    pub(crate) targets: Vec<Target>,
    pub(crate) manifest: Option<Manifest>,
}

/// What the arguments say of results' places.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wish<'a> {
    pub(crate) out: Option<&'a Path>,
    pub(crate) format: Option<Format>,
    pub(crate) overwrite: bool,
    pub(crate) resume: bool,
}

/// Refuses what cannot be meant, before any work: outputs that exist, that are inputs,
/// that two inputs share.
pub(crate) fn plan(inputs: &Gathered, wish: Wish<'_>) -> Result<Plan, Failure> {
    if wish.out.is_none() && io::stdout().is_terminal() {
        return Err(Failure::usage(
            "where should the result go? give -o OUT.npy, -o OUT.csv, or -o - for standard output",
        ));
    }
    let out = wish.out.unwrap_or(Path::new("-"));
    let paths = inputs.paths();
    // One file goes into one file, however it was found.
    let is_file = out.is_file() || Format::of(out).is_some() || input::is_standard(out);
    let plan = match &*paths {
        [_] if !inputs.many || is_file => {
            if wish.resume {
                let message = "--resume is for a directory of results";
                return Err(Failure::usage(message));
            }
            let format = choose(out, wish.format)?;
            let place = Place::new(out, wish.overwrite, &paths)?;
            let name = String::new();
            let targets = vec![Target {
                place,
                format,
                name,
            }];
            let manifest = None;
            Plan { targets, manifest }
        }
        _ if input::is_standard(out) => {
            return Err(Failure::usage(
                "several inputs need a directory for their results: -o DIRECTORY",
            ));
        }
        _ => in_folder(inputs, out, wish)?,
    };
    // The surest check is to try; they are all in one directory.
    if let Some(target) = plan.targets.first() {
        target.place.try_out()?;
    }
    Ok(plan)
}

/// The format asked for, else the one that the name says.
fn choose(path: &Path, format: Option<Format>) -> Result<Format, Failure> {
    let named = if input::is_standard(path) || path.is_dir() {
        Some(Format::Npy) // a directory is refused later, for what it is
    } else {
        Format::of(path)
    };
    format.or(named).ok_or_else(|| {
        let path = path.display();
        Failure::usage(format!(
            "{path}: end the output in .npy or .csv, or give --format"
        ))
    })
}

/// A file in `folder` for each input, named after it; below it, where the input lay below
/// a directory.
fn in_folder(inputs: &Gathered, folder: &Path, wish: Wish<'_>) -> Result<Plan, Failure> {
    let shown = folder.display();
    if !folder.is_dir() && (folder.exists() || Format::of(folder).is_some()) {
        return Err(Failure::usage(format!(
            "{shown}: several inputs need a directory for their results, not one file"
        )));
    }
    let format = wish.format.unwrap_or(Format::Npy);
    let sources: HashSet<PathBuf> = (inputs.files.iter())
        .filter_map(|found| found.path.canonicalize().ok())
        .collect();
    let mut owners: HashMap<PathBuf, &Path> = HashMap::new();
    let mut names = Vec::new();
    for Found { path, below } in &inputs.files {
        let name = format.name_for(path, below);
        let target = folder.join(&name);
        if let Some(other) = owners.insert(target.clone(), path) {
            return Err(Failure::usage(format!(
                "{} and {} would both write {}; give their directory, whose tree is kept, or \
                 evaluate them into different directories",
                input::name(other),
                input::name(path),
                target.display()
            )));
        }
        if target
            .canonicalize()
            .is_ok_and(|target| sources.contains(&target))
        {
            let target = target.display();
            return Err(Failure::usage(format!(
                "{target}: is an input; give another directory"
            )));
        }
        let Some(name) = name.to_str() else {
            let message = "its name is not UTF-8, and a manifest could not name it; rename it";
            let input = input::name(path);
            return Err(Failure::usage(format!("{input}: {message}")));
        };
        names.push(name.to_owned());
    }
    place::folder(folder)?;
    let parents: BTreeSet<PathBuf> = (names.iter())
        .filter_map(|name| folder.join(name).parent().map(Path::to_owned))
        .collect();
    for parent in &parents {
        std::fs::create_dir_all(parent)
            .map_err(|error| Failure::writing(&parent.display().to_string(), &error))?;
        if wish.resume {
            remove_abandoned(parent);
        }
    }
    let manifest = Manifest::open(folder)?;
    let target = |name: String| {
        let overwrite = wish.overwrite || wish.resume && manifest.knows(&name);
        let place = Place::new(&folder.join(&name), overwrite, &[]).map_err(|failure| {
            if manifest.knows(&name) {
                failure.hinted(" (--resume skips what is done)")
            } else {
                failure
            }
        })?;
        let place = place.hashed();
        Ok(Target {
            place,
            format,
            name,
        })
    };
    let targets = names.into_iter().map(target).collect::<Result<_, _>>()?;
    let manifest = Some(manifest);
    Ok(Plan { targets, manifest })
}

impl Format {
    fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_lowercase().as_str() {
            "npy" => Some(Self::Npy),
            "csv" => Some(Self::Csv),
            _ => None,
        }
    }

    /// `walk.dat` becomes `walk.npy`, where it lies.
    fn name_for(self, input: &Path, below: &Path) -> PathBuf {
        let below = if input::is_standard(input) {
            Path::new("stdin")
        } else {
            below
        };
        below.with_extension(match self {
            Self::Npy => "npy",
            Self::Csv => "csv",
        })
    }

    /// The least that a rotation takes.
    fn rotation_bytes(self, encoding: Encoding) -> f64 {
        match self {
            Self::Npy => encoding.bytes() as f64,
            Self::Csv => 8.0, // four times a digit and a comma
        }
    }
}

impl Target {
    pub(crate) fn format(&self) -> Format {
        self.format
    }

    /// Refuses a result for which the disk has no room.
    pub(crate) fn has_room(
        &self,
        name: &str,
        tracks: usize,
        samples: usize,
        encoding: Encoding,
    ) -> Result<(), Failure> {
        if self.place.is_standard() {
            return Ok(());
        }
        let bytes = tracks as f64 * samples as f64 * self.format.rotation_bytes(encoding);
        let folder = match self.place.path().parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        room::on_disk(name, (tracks, samples), bytes, folder)
    }

    /// How the manifest calls it.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Writes what `write` has to say; see [`Place::prepare`].
    pub(crate) fn prepare(
        &self,
        write: impl FnOnce(&mut Stream) -> io::Result<()>,
    ) -> Result<Written, Failure> {
        self.place.prepare(None, write)
    }

    /// Writes one result, chunk by chunk, while `evaluate` makes the next.
    pub(crate) fn write_rotations(
        &self,
        result: &ResultShape<'_>,
        evaluate: impl FnOnce(&mut Sink<'_>) -> Result<(), Ended>,
    ) -> Result<Written, Failure> {
        let (tracks, samples) = (result.set.track_count(), result.timeline.len());
        let (progress, measure): (_, fn(&[u8]) -> u64) = match self.format {
            Format::Csv => (Progress::new("writing", samples as u64 + 1), lines),
            Format::Npy => {
                let total = (tracks * samples * result.encoding.bytes()) as u64;
                (Progress::new("writing", total), length)
            }
        };
        let mut unevaluated = None;
        let written = self.place.prepare(Some((progress, measure)), |out| {
            let mut writer = ResultWriter::Waiting(out);
            let evaluated = evaluate(&mut |chunk| {
                let taken = writer.write(self.format, result, chunk.rotations);
                taken.map_err(Ended::Writing)
            });
            match evaluated {
                Ok(()) => writer.finish(self.format, result),
                Err(Ended::Writing(error)) => Err(error),
                Err(Ended::Evaluating(error)) => {
                    unevaluated = Some(error);
                    Err(io::Error::other("the rest could not be evaluated"))
                }
            }
        });
        match unevaluated {
            Some(error) if signals::stopped().is_none() => {
                Err(Failure::evaluating(result.name, &error))
            }
            _ => written,
        }
    }
}

fn lines(bytes: &[u8]) -> u64 {
    bytes.iter().filter(|&&byte| byte == b'\n').count() as u64
}

fn length(bytes: &[u8]) -> u64 {
    bytes.len() as u64
}

/// What is written: a set's rotations at the samples of a timeline.
pub(crate) struct ResultShape<'a> {
    /// The input's, for messages.
    pub(crate) name: &'a str,
    pub(crate) set: &'a TrackSet,
    pub(crate) timeline: &'a Timeline,
    pub(crate) layout: Layout,
    pub(crate) order: ComponentOrder,
    pub(crate) encoding: Encoding,
}

/// What takes the chunks of a result.
pub(crate) type Sink<'a> = dyn FnMut(Chunk<'_>) -> Result<(), Ended> + 'a;

/// Why a result did not become whole.
#[derive(Debug)]
pub(crate) enum Ended {
    Writing(io::Error),
    Evaluating(Error),
}

impl From<Error> for Ended {
    fn from(error: Error) -> Self {
        Self::Evaluating(error)
    }
}

/// A writer of one format. Nothing is written before there is a first chunk: what
/// cannot be evaluated leaves nothing behind, in a pipe neither.
enum ResultWriter<'a, 'o> {
    Waiting(&'o mut Stream),
    Npy(NpyWriter<&'o mut Stream>),
    Csv(Box<CsvWriter<'a, &'o mut Stream>>),
    Failed,
}

impl<'a> ResultWriter<'a, '_> {
    /// Writes the header if that is yet to be done.
    fn start(&mut self, format: Format, result: &ResultShape<'a>) -> io::Result<()> {
        let (tracks, samples) = (result.set.track_count(), result.timeline.len());
        *self = match std::mem::replace(self, Self::Failed) {
            Self::Waiting(out) if format == Format::Csv => {
                let (set, timeline) = (result.set, result.timeline);
                Self::Csv(Box::new(CsvWriter::new(
                    out,
                    set,
                    timeline,
                    result.encoding,
                )?))
            }
            Self::Waiting(out) => {
                let (rows, columns) = match result.layout {
                    Layout::TrackMajor => (tracks, samples),
                    Layout::FrameMajor => (samples, tracks),
                };
                let (order, encoding) = (result.order, result.encoding);
                Self::Npy(NpyWriter::new(out, rows, columns, order, encoding)?)
            }
            started => started,
        };
        Ok(())
    }

    fn write(
        &mut self,
        format: Format,
        result: &ResultShape<'a>,
        rotations: &[Quat],
    ) -> io::Result<()> {
        self.start(format, result)?;
        match self {
            Self::Csv(writer) => writer.write(rotations),
            // In pieces, so that a signal is noticed soon.
            Self::Npy(writer) => rotations
                .chunks(PIECE)
                .try_for_each(|piece| writer.write(piece)),
            Self::Waiting(_) | Self::Failed => Err(io::Error::other("an earlier error")),
        }
    }

    fn finish(mut self, format: Format, result: &ResultShape<'a>) -> io::Result<()> {
        self.start(format, result)?;
        match self {
            Self::Csv(writer) => writer.finish(),
            Self::Npy(writer) => writer.finish().map(drop),
            Self::Waiting(_) | Self::Failed => Err(io::Error::other("an earlier error")),
        }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.place.fmt(f)
    }
}
