//! Results of evaluations: their targets, planned and checked before any work, and how they are written.

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
use tumble_formats::motion::SampledClip;

use crate::arguments::gather::GatheredInputs;
use crate::arguments::input;
use crate::batch::destination::{Destination, WrittenFile};
use crate::batch::folder;
use crate::batch::manifest::Manifest;
use crate::batch::room;
use crate::batch::stream::OutputStream;
use crate::messages::exit::Failure;
use crate::messages::progress::Progress;
use crate::messages::{signals, words};

/// The target of one result: its destination and format.
pub(crate) struct ResultTarget {
    destination: Destination,
    format: &'static Format,
    /// Its path below the directory of results; empty for a single result.
    name: String,
    /// The destination of the times, for a format that stores none.
    times: Option<Destination>,
}

/// One target for each input, and the manifest of their directory.
#[derive(Default)]
pub(crate) struct OutputPlan {
    /// The inputs that have targets.
    pub(crate) paths: Vec<PathBuf>,
    pub(crate) targets: Vec<ResultTarget>,
    /// The failures of inputs that have no target.
    pub(crate) refused: Vec<Failure>,
    pub(crate) manifest: Option<Manifest>,
}

/// The options that decide where results go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutputRequest<'a> {
    pub(crate) out: Option<&'a Path>,
    pub(crate) format: Option<&'static Format>,
    pub(crate) overwrite: bool,
    pub(crate) resume: bool,
}

/// Plans the targets. Refuses, before any work, outputs that exist, that are inputs, or that two inputs share.
pub(crate) fn plan(
    inputs: &GatheredInputs,
    request: OutputRequest<'_>,
) -> Result<OutputPlan, Failure> {
    if request.out.is_none() && io::stdout().is_terminal() {
        return Err(Failure::usage(format!(
            "where should the result go? give {}, or -o - for standard output",
            extensions(|name| format!("-o OUT.{name}")).join(", ")
        )));
    }
    let out = request.out.unwrap_or(Path::new("-"));
    let paths = inputs.paths();
    // A single input has a single output, however it was found.
    let is_file = out.is_file() || of(out).is_some() || input::is_standard(out);
    let is_folder = out.is_dir() || out.as_os_str().as_encoded_bytes().ends_with(b"/");
    let plan = match &*paths {
        [_] if is_file || !inputs.many && !is_folder => {
            if request.resume {
                let message = "--resume is for a directory of results";
                return Err(Failure::usage(message));
            }
            let format = choose(out, request.format)?;
            let destination = Destination::new(out, request.overwrite, &paths)?;
            // The surest check is to try.
            destination.check_writable()?;
            OutputPlan {
                paths,
                targets: vec![ResultTarget::new(destination, format, String::new())],
                ..OutputPlan::default()
            }
        }
        _ if input::is_standard(out) => {
            return Err(Failure::usage(
                "several inputs need a directory for their results: -o DIRECTORY",
            ));
        }
        _ => folder::in_folder(inputs, out, request)?,
    };
    if plan.manifest.is_some() {
        check_writable(&plan.targets)?;
    }
    Ok(plan)
}

/// Tries to write into a directory of results; fails if none can be written.
fn check_writable(targets: &[ResultTarget]) -> Result<(), Failure> {
    let mut tried = HashSet::new();
    let mut failed = None;
    for target in targets {
        if !tried.insert(target.path().parent()) {
            continue;
        }
        match target.destination.check_writable() {
            Ok(()) => return Ok(()),
            Err(failure) => failed.get_or_insert(failure),
        };
    }
    failed.map_or(Ok(()), Err)
}

/// The requested format, else that of the path's extension.
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

/// The format of results of a file's extension.
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

/// The help of `--out`.
pub(crate) fn out_help() -> String {
    format!(
        "Where to write: {}, `-` (standard output), or a directory for several inputs",
        extensions(|name| format!("OUT.{name}")).join(", ")
    )
}

impl ResultTarget {
    pub(crate) fn new(destination: Destination, format: &'static Format, name: String) -> Self {
        Self {
            destination,
            format,
            name,
            times: None,
        }
    }

    /// The same, with a file for the times of what is written.
    pub(crate) fn with_times(self, destination: Destination) -> Result<Self, Failure> {
        destination.refuse_same(self.path())?;
        destination.check_writable()?;
        let times = Some(destination);
        Ok(Self { times, ..self })
    }

    /// The format of the result.
    pub(crate) fn format(&self) -> &'static Format {
        self.format
    }

    /// The path of its destination.
    pub(crate) fn path(&self) -> &Path {
        self.destination.path()
    }

    /// Whether it is standard output.
    pub(crate) fn is_standard(&self) -> bool {
        self.destination.is_standard()
    }

    /// Its name in messages, its extension, and whether times go to a file of their own.
    pub(crate) fn motion_options(&self) -> MotionOptions {
        let ending = self.path().extension().unwrap_or_default();
        MotionOptions {
            name: self.to_string(),
            format: ending.to_string_lossy().to_lowercase(),
            times_apart: self.times.is_some(),
            ..MotionOptions::default()
        }
    }

    /// The writer of plain rotations of its format.
    pub(crate) fn results(&self) -> Result<&'static WriteResults, Failure> {
        self.format.write.as_ref().ok_or_else(|| {
            let all = Format::writable().filter(|format| format.write.is_some());
            let names: Vec<&str> = all.map(|format| format.name).collect();
            Failure::usage(format!(
                "{self}: {} stores whole clips; for rotations or poses alone use {}",
                self.format.name,
                names.join(" or ")
            ))
        })
    }

    /// The target of one of several clips of an input, beside that of all: `fox.npy` becomes `fox.Run.npy`.
    pub(crate) fn of_clip(&self, clip: &str) -> Result<Self, Failure> {
        let with = |path: &Path| path.with_extension(format!("{clip}.{}", self.format.name));
        let name = with(Path::new(&self.name));
        let destination = self.destination.renamed(&with(self.destination.path()))?;
        Ok(Self::new(
            destination,
            self.format,
            name.display().to_string(),
        ))
    }

    /// Refuses a result for which the disk has no room.
    pub(crate) fn has_room(
        &self,
        name: &str,
        tracks: usize,
        samples: usize,
        encoding: Encoding,
    ) -> Result<(), Failure> {
        if self.destination.is_standard() {
            return Ok(());
        }
        let bytes = tracks as f64 * samples as f64 * (self.results()?.rotation_bytes)(encoding);
        let folder = match self.destination.path().parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        room::on_disk(name, (tracks, samples), bytes, folder)
    }

    /// Its name in the manifest.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Writes by `write`; see [`Destination::prepare`].
    pub(crate) fn prepare(
        &self,
        write: impl FnOnce(&mut OutputStream) -> io::Result<()>,
    ) -> Result<WrittenFile, Failure> {
        self.destination.prepare(None, write)
    }

    /// Writes a motion file, which `write` makes in memory, and prints its warnings.
    pub(crate) fn write_motion(
        &self,
        write: impl FnOnce(&mut Vec<u8>) -> Result<Vec<Diagnostic>, WriteError>,
    ) -> Result<WrittenFile, Failure> {
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

    /// Writes the times of a motion file, where they go to a file of their own.
    pub(crate) fn write_times(&self, sampled: &[SampledClip<'_>]) -> Result<(), Failure> {
        let (Some(destination), [sampled]) = (&self.times, sampled) else {
            return Ok(());
        };
        let written = destination.prepare(None, |out| write_frame_times(sampled, out))?;
        written.commit()
    }

    /// Writes one result that is in memory.
    pub(crate) fn write_whole(
        &self,
        result: &ResultShape<'_>,
        rotations: &[Quat],
    ) -> Result<WrittenFile, Failure> {
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
        evaluate: impl FnOnce(&mut ChunkSink<'_>) -> Result<(), ResultError>,
    ) -> Result<WrittenFile, Failure> {
        let (tracks, samples) = (result.set.track_count(), result.timeline.len());
        let write = self.results()?;
        let (progress, measure): (_, fn(&[u8]) -> u64) = if write.is_text {
            (Progress::new("writing", samples as u64 + 1), lines)
        } else {
            let total = (tracks * samples * result.encoding.bytes()) as u64;
            (Progress::new("writing", total), length)
        };
        let mut unevaluated = None;
        let written = self.destination.prepare(Some((progress, measure)), |out| {
            let mut writer = LateWriter {
                results: write,
                result: *result,
                state: WriterState::NotStarted(out),
            };
            let evaluated = evaluate(&mut |chunk| {
                writer
                    .write(bytemuck::cast_slice(chunk.rows))
                    .map_err(ResultError::Writing)
            });
            match evaluated {
                Ok(()) => writer.finish(),
                Err(ResultError::Writing(error)) => Err(error),
                Err(ResultError::Evaluating(error)) => {
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

/// Accepts the chunks of a result.
pub(crate) type ChunkSink<'a> = dyn FnMut(Chunk<'_>) -> Result<(), ResultError> + 'a;

/// Why a result is incomplete.
#[derive(Debug)]
pub(crate) enum ResultError {
    Writing(io::Error),
    Evaluating(Error),
}

impl From<Error> for ResultError {
    fn from(error: Error) -> Self {
        Self::Evaluating(error)
    }
}

/// A writer of one format. Nothing is written before the first chunk, so that a failed evaluation leaves
/// nothing behind, even in a pipe.
struct LateWriter<'a> {
    results: &'static WriteResults,
    result: ResultShape<'a>,
    state: WriterState<'a>,
}

enum WriterState<'a> {
    NotStarted(&'a mut OutputStream),
    Writing(Box<dyn ResultWriter + 'a>),
    Failed,
}

impl<'a> LateWriter<'a> {
    /// The writer, after the header.
    fn started(&mut self) -> io::Result<&mut Box<dyn ResultWriter + 'a>> {
        self.state = match std::mem::replace(&mut self.state, WriterState::Failed) {
            WriterState::NotStarted(out) => {
                WriterState::Writing(self.results.begin(out, &self.result)?)
            }
            started => started,
        };
        match &mut self.state {
            WriterState::Writing(writer) => Ok(writer),
            WriterState::NotStarted(_) | WriterState::Failed => {
                Err(io::Error::other("an earlier error"))
            }
        }
    }

    fn write(&mut self, rotations: &[Quat]) -> io::Result<()> {
        self.started()?.write(rotations)
    }

    fn finish(mut self) -> io::Result<()> {
        self.started()?;
        match self.state {
            WriterState::Writing(writer) => writer.finish(),
            WriterState::NotStarted(_) | WriterState::Failed => Ok(()),
        }
    }
}

impl fmt::Display for ResultTarget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.destination.fmt(f)
    }
}
