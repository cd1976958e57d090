//! Results of evaluations: where they go, planned and checked before any work, and
//! how they are written.

use std::collections::HashSet;
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use glam::Quat;
use tumble::{Chunk, Encoding, Error};
use tumble_formats::Diagnostic;
use tumble_formats::format::{
    Format, MotionOptions, ResultShape, ResultWriter, WriteError, WriteResults,
};
use tumble_formats::kitti::write_frame_times;
use tumble_formats::motion::Sampled;

use crate::arguments::gather::Gathered;
use crate::arguments::input;
use crate::batch::folder;
use crate::batch::manifest::Manifest;
use crate::batch::place::{Place, Written};
use crate::batch::room;
use crate::batch::stream::Stream;
use crate::messages::exit::Failure;
use crate::messages::progress::Progress;
use crate::messages::{signals, words};

/// Where one result goes.
pub(crate) struct Target {
    place: Place,
    format: &'static Format,
    /// Below the directory of results; empty for a result in no such directory.
    name: String,
    /// Where the times go, for a format that has none.
    times: Option<Place>,
}

/// One target for each input, and the manifest of the directory that they are in.
#[derive(Default)]
pub(crate) struct Plan {
    /// The inputs that have targets.
    pub(crate) paths: Vec<PathBuf>,
    pub(crate) targets: Vec<Target>,
    /// Inputs that have none: they have failed.
    pub(crate) refused: Vec<Failure>,
    pub(crate) manifest: Option<Manifest>,
}

/// What the arguments say of results' places.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wish<'a> {
    pub(crate) out: Option<&'a Path>,
    pub(crate) format: Option<&'static Format>,
    pub(crate) overwrite: bool,
    pub(crate) resume: bool,
}

/// Refuses what cannot be meant, before any work: outputs that exist, that are inputs,
/// that two inputs share.
pub(crate) fn plan(inputs: &Gathered, wish: Wish<'_>) -> Result<Plan, Failure> {
    if wish.out.is_none() && io::stdout().is_terminal() {
        return Err(Failure::usage(format!(
            "where should the result go? give {}, or -o - for standard output",
            extensions(|name| format!("-o OUT.{name}")).join(", ")
        )));
    }
    let out = wish.out.unwrap_or(Path::new("-"));
    let paths = inputs.paths();
    // One file goes into one file, however it was found.
    let is_file = out.is_file() || of(out).is_some() || input::is_standard(out);
    let is_folder = out.is_dir() || out.as_os_str().as_encoded_bytes().ends_with(b"/");
    let plan = match &*paths {
        [_] if is_file || !inputs.many && !is_folder => {
            if wish.resume {
                let message = "--resume is for a directory of results";
                return Err(Failure::usage(message));
            }
            let format = choose(out, wish.format)?;
            let place = Place::new(out, wish.overwrite, &paths)?;
            // The surest check is to try.
            place.try_out()?;
            Plan {
                paths,
                targets: vec![Target::new(place, format, String::new())],
                ..Plan::default()
            }
        }
        _ if input::is_standard(out) => {
            return Err(Failure::usage(
                "several inputs need a directory for their results: -o DIRECTORY",
            ));
        }
        _ => folder::in_folder(inputs, out, wish)?,
    };
    if plan.manifest.is_some() {
        try_out(&plan.targets)?;
    }
    Ok(plan)
}

/// Tries a file in each directory of results; where none can be written into, no work is done.
fn try_out(targets: &[Target]) -> Result<(), Failure> {
    let mut tried = HashSet::new();
    let mut failed = None;
    for target in targets {
        if !tried.insert(target.path().parent()) {
            continue;
        }
        match target.place.try_out() {
            Ok(()) => return Ok(()),
            Err(failure) => failed.get_or_insert(failure),
        };
    }
    failed.map_or(Ok(()), Err)
}

/// The format asked for, else the one that the name says.
pub(crate) fn choose(
    path: &Path,
    format: Option<&'static Format>,
) -> Result<&'static Format, Failure> {
    let named = if input::is_standard(path) {
        Format::writable().next()
    } else {
        of(path)
    };
    format.or(named).ok_or_else(|| {
        let (path, extensions) = (path.display(), extensions(|name| format!(".{name}")));
        let extensions = extensions.join(", ");
        Failure::usage(format!(
            "{path}: end the output in {extensions}, or give --format"
        ))
    })
}

/// The format of results that a file's name tells.
pub(crate) fn of(path: &Path) -> Option<&'static Format> {
    Format::of(path).filter(|format| format.is_writable())
}

/// The extensions of results, each as `show` has it.
fn extensions(show: impl Fn(&str) -> String) -> Vec<String> {
    Format::writable().map(|format| show(format.name)).collect()
}

/// Reads the name of a format of results, for clap.
pub(crate) fn format() -> impl TypedValueParser<Value = &'static Format> {
    let values =
        Format::writable().map(|format| PossibleValue::new(format.name).help(format.summary));
    PossibleValuesParser::new(values)
        .map(|name| Format::named(&name).expect("clap takes names of the table alone"))
}

/// Where a result may go, for help.
pub(crate) fn out_help() -> String {
    format!(
        "Where to write: {}, `-` (standard output), or a directory for several inputs",
        extensions(|name| format!("OUT.{name}")).join(", ")
    )
}

impl Target {
    pub(crate) fn new(place: Place, format: &'static Format, name: String) -> Self {
        Self {
            place,
            format,
            name,
            times: None,
        }
    }

    /// The same, with a file for the times of what is written.
    pub(crate) fn with_times(self, place: Place) -> Result<Self, Failure> {
        place.refuse_same(self.path())?;
        place.try_out()?;
        let times = Some(place);
        Ok(Self { times, ..self })
    }

    /// The format of the result.
    pub(crate) fn format(&self) -> &'static Format {
        self.format
    }

    /// Where it goes.
    pub(crate) fn path(&self) -> &Path {
        self.place.path()
    }

    /// Whether it is standard output.
    pub(crate) fn is_standard(&self) -> bool {
        self.place.is_standard()
    }

    /// How messages call it, and by which of its format's endings it is called.
    pub(crate) fn motion_options(&self) -> MotionOptions {
        let ending = self.path().extension().unwrap_or_default();
        MotionOptions {
            name: self.to_string(),
            format: ending.to_string_lossy().to_lowercase(),
            times_apart: self.times.is_some(),
            ..MotionOptions::default()
        }
    }

    /// How its format holds rotations as they come.
    pub(crate) fn results(&self) -> Result<&'static WriteResults, Failure> {
        self.format.write.as_ref().ok_or_else(|| {
            let all = Format::writable().filter(|format| format.write.is_some());
            let names: Vec<&str> = all.map(|format| format.name).collect();
            Failure::usage(format!(
                "{self}: {} holds whole clips; for rotations or poses alone give {}",
                self.format.name,
                names.join(" or ")
            ))
        })
    }

    /// Where the result of one of several clips of an input goes, beside the place where that of
    /// all would: `fox.npy` becomes `fox.Run.npy`.
    pub(crate) fn of_clip(&self, clip: &str) -> Result<Self, Failure> {
        let with = |path: &Path| path.with_extension(format!("{clip}.{}", self.format.name));
        let name = with(Path::new(&self.name));
        let place = self.place.renamed(&with(self.place.path()))?;
        Ok(Self::new(place, self.format, name.display().to_string()))
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
        let bytes = tracks as f64 * samples as f64 * (self.results()?.rotation_bytes)(encoding);
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

    /// Writes a motion file, which `write` makes in memory, and says its warnings.
    pub(crate) fn write_motion(
        &self,
        write: impl FnOnce(&mut Vec<u8>) -> Result<Vec<Diagnostic>, WriteError>,
    ) -> Result<Written, Failure> {
        let mut bytes = Vec::new();
        let warnings = write(&mut bytes).map_err(|error| match error {
            WriteError::Io(error) => Failure::writing(&self.to_string(), &error),
            WriteError::Refused(diagnostic) => Failure::input(&diagnostic, ""),
        })?;
        for warning in warnings {
            words::note(&warning.to_string());
        }
        self.prepare(|out| out.write_all(&bytes))
    }

    /// Writes the times of what was written as a motion file, where they go into a file of their own.
    pub(crate) fn write_times(&self, sampled: &[Sampled<'_>]) -> Result<(), Failure> {
        let (Some(place), [sampled]) = (&self.times, sampled) else {
            return Ok(());
        };
        let written = place.prepare(None, |out| write_frame_times(sampled, out))?;
        written.commit()
    }

    /// Writes one result that is in memory.
    pub(crate) fn write_whole(
        &self,
        result: &ResultShape<'_>,
        rotations: &[Quat],
    ) -> Result<Written, Failure> {
        let results = self.results()?;
        self.prepare(|out| {
            let mut writer = results.begin(out, result)?;
            writer.write(rotations)?;
            writer.finish()
        })
    }

    /// Writes one result, chunk by chunk, while `evaluate` makes the next.
    pub(crate) fn write_rotations(
        &self,
        result: &ResultShape<'_>,
        evaluate: impl FnOnce(&mut Sink<'_>) -> Result<(), Ended>,
    ) -> Result<Written, Failure> {
        let (tracks, samples) = (result.set.track_count(), result.timeline.len());
        let write = self.results()?;
        let (progress, measure): (_, fn(&[u8]) -> u64) = if write.is_text {
            (Progress::new("writing", samples as u64 + 1), lines)
        } else {
            let total = (tracks * samples * result.encoding.bytes()) as u64;
            (Progress::new("writing", total), length)
        };
        let mut unevaluated = None;
        let written = self.place.prepare(Some((progress, measure)), |out| {
            let mut writer = LateWriter {
                results: write,
                result: *result,
                state: State::Waiting(out),
            };
            let evaluated = evaluate(&mut |chunk| {
                writer
                    .write(bytemuck::cast_slice(chunk.rows))
                    .map_err(Ended::Writing)
            });
            match evaluated {
                Ok(()) => writer.finish(),
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
struct LateWriter<'a> {
    results: &'static WriteResults,
    result: ResultShape<'a>,
    state: State<'a>,
}

enum State<'a> {
    Waiting(&'a mut Stream),
    Writing(Box<dyn ResultWriter + 'a>),
    Failed,
}

impl<'a> LateWriter<'a> {
    /// What writes, after the header.
    fn started(&mut self) -> io::Result<&mut Box<dyn ResultWriter + 'a>> {
        self.state = match std::mem::replace(&mut self.state, State::Failed) {
            State::Waiting(out) => State::Writing(self.results.begin(out, &self.result)?),
            started => started,
        };
        match &mut self.state {
            State::Writing(writer) => Ok(writer),
            State::Waiting(_) | State::Failed => Err(io::Error::other("an earlier error")),
        }
    }

    fn write(&mut self, rotations: &[Quat]) -> io::Result<()> {
        self.started()?.write(rotations)
    }

    fn finish(mut self) -> io::Result<()> {
        self.started()?;
        match self.state {
            State::Writing(writer) => writer.finish(),
            State::Waiting(_) | State::Failed => Ok(()),
        }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.place.fmt(f)
    }
}
