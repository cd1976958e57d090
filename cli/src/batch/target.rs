//! Where a file goes and how it is written: its destination, checked before any work, written completely or not
//! at all; and the target of a result, which is a destination with a format.

use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use glam::Quat;
use tumble::{Chunk, Encoding, Error};
use tumble_formats::Diagnostic;
use tumble_formats::end_frame::EndRows;
use tumble_formats::folder::Folder;
use tumble_formats::format::{
    Document, Format, MotionOptions, ResultShape, ResultWriter, WriteError, WriteResults,
};
use tumble_formats::kitti::write_frame_times;
use tumble_formats::motion::SampledClip;
use tumble_formats::output::{Output, check_target};

use crate::batch::digest::Digest;
use crate::batch::room;
use crate::messages::exit::{BROKEN_PIPE, Failure, OUTPUT};
use crate::messages::names;
use crate::messages::progress::Progress;
use crate::messages::signals::{self, WritingGuard};

/// The requested format, else that of the path's extension.
pub(crate) fn choose(
    path: &Path,
    format: Option<&'static Format>,
) -> Result<&'static Format, Failure> {
    let named = if names::is_standard(path) {
        Format::writable().next()
    } else {
        of(path)
    };
    if let (Some(format), Some(named)) = (format, named)
        && format.name != named.name
        && !(format.is_text && named.is_text)
        && !names::is_standard(path)
    {
        return Err(Failure::usage(format!(
            "{}: its name is one of {}, and --format says {}; give another name, or leave out --format",
            path.display(),
            named.name,
            format.name
        )));
    }
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

/// The extensions of all formats that can be written, each formatted by `show`.
pub(super) fn extensions(show: impl Fn(&str) -> String) -> Vec<String> {
    Format::writable().map(|format| show(format.name)).collect()
}

/// Reads the name of a format of results, for clap.
pub(crate) fn format() -> impl TypedValueParser<Value = &'static Format> {
    let values =
        Format::writable().map(|format| PossibleValue::new(format.name).help(format.summary));
    PossibleValuesParser::new(values)
        .map(|name| Format::named(&name).expect("clap takes names of the table alone"))
}

/// The help of `--output`.
pub(crate) fn out_help() -> String {
    format!(
        "Where to write: {}, `-` (standard output), or a directory for several inputs",
        extensions(|name| format!("OUT.{name}")).join(", ")
    )
}

/// Refuses JSON and a result on standard output together.
pub(crate) fn refuse_both_on_standard(prints_json: bool, out: &Path) -> Result<(), Failure> {
    match prints_json && names::is_standard(out) {
        true => Err(Failure::usage(
            "--json and the result cannot both go to standard output; give -o FILE",
        )),
        false => Ok(()),
    }
}

fn path_of_clip(path: &Path, clip: &str, format: &Format) -> PathBuf {
    path.with_extension(format!("{clip}.{}", format.ending()))
}

/// The name of the result of one of several clips, from that of all: `fox.npy` becomes `fox.Run.npy`.
pub(super) fn name_of_clip(name: &str, clip: &str, format: &Format) -> String {
    path_of_clip(Path::new(name), clip, format)
        .display()
        .to_string()
}

/// The target of one result: its destination and format.
#[derive(Clone)]
pub(crate) struct ResultTarget {
    destination: Destination,
    format: &'static Format,
    /// Its path below the directory of results; empty for a single result.
    name: String,
    /// The destination of the times, for a format that stores none.
    times: Option<Destination>,
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

    /// The same, with a file for the times of the result.
    pub(crate) fn with_times(self, destination: Destination) -> Result<Self, Failure> {
        destination.refuse_same(self.path())?;
        destination.check_writable()?;
        let times = Some(destination);
        Ok(Self { times, ..self })
    }

    /// Opens and drops the file: its directory may be read-only.
    pub(crate) fn check_writable(&self) -> Result<(), Failure> {
        self.destination.check_writable()
    }

    /// The format of the result.
    pub(crate) fn format(&self) -> &'static Format {
        self.format
    }

    /// The path of its destination.
    pub(crate) fn path(&self) -> &Path {
        self.destination.path()
    }

    /// Its name in messages, its extension, and whether times go to a separate file.
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
        let with = |path: &Path| path_of_clip(path, clip, self.format);
        let name = name_of_clip(&self.name, clip, self.format);
        let destination = self.destination.renamed(with)?;
        Ok(Self::new(destination, self.format, name))
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

    /// Writes a motion file, which `write` makes in memory with warnings.
    pub(crate) fn write_motion(
        &self,
        write: impl FnOnce(&mut Vec<u8>) -> Result<Vec<Diagnostic>, WriteError>,
    ) -> Result<WrittenFile, Failure> {
        let mut bytes = Vec::new();
        let warnings = write(&mut bytes).map_err(|error| match error {
            WriteError::Io(error) => Failure::writing(&self.to_string(), &error),
            WriteError::Refused(diagnostic) => Failure::input(&diagnostic, ""),
        })?;
        let written = self.prepare(|out| out.write_all(&bytes))?;
        Ok(WrittenFile {
            warnings,
            ..written
        })
    }

    /// Writes sampled clips as a motion file: into `document`, where the input's file is written again
    /// with other keys of the clips of these indices, else into a new one.
    pub(crate) fn write_clips(
        &self,
        sampled: &[SampledClip<'_>],
        indices: impl IntoIterator<Item = usize>,
        document: Option<&dyn Document>,
        options: &MotionOptions,
    ) -> Result<WrittenFile, Failure> {
        let written = self.write_motion(|out| match document {
            None => self.format.write_clips(sampled, options, out),
            Some(document) => {
                let sampled = sampled.iter().cloned();
                let clips: Vec<(usize, SampledClip<'_>)> =
                    indices.into_iter().zip(sampled).collect();
                document.write(&clips, options, self.path(), out)
            }
        })?;
        Ok(written.with(self.write_times(sampled)?))
    }

    /// Writes the times of a motion file, if they are written to a separate file.
    fn write_times(&self, sampled: &[SampledClip<'_>]) -> Result<Option<WrittenFile>, Failure> {
        let (Some(destination), [sampled]) = (&self.times, sampled) else {
            return Ok(None);
        };
        let written = destination.prepare(None, |out| write_frame_times(sampled, out));
        written.map(Some)
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
        mut ends: EndRows,
        evaluate: impl FnOnce(&mut ChunkSink<'_>) -> Result<(), ResultError>,
    ) -> Result<WrittenFile, Failure> {
        let (tracks, samples) = (result.set.track_count(), result.timeline.len());
        let write = self.results()?;
        let (progress, measure): (_, fn(&[u8]) -> u64) = if self.format().is_text {
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
                    .write(&ends.next(bytemuck::cast_slice(chunk.rows)))
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

/// A writer of one format. Nothing is written before the first chunk, so that a failed evaluation writes nothing, even
/// into a pipe.
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

/// The destination of one file.
#[derive(Debug, Clone)]
pub(crate) struct Destination {
    path: PathBuf,
    /// The open directory that it is below, and its path in it. `None` for a single file, whose directory is opened
    /// when its writing begins.
    below: Option<(Folder, PathBuf)>,
    overwrite: bool,
    /// Files that it must not replace.
    inputs: Vec<PathBuf>,
    /// Whether its bytes are hashed as they are written.
    hashed: bool,
    /// A part of the name of its temporary file.
    mark: String,
}

/// A complete file that has its temporary name. If it is dropped before [`WrittenFile::commit`], nothing
/// remains.
pub(crate) struct WrittenFile {
    output: Output,
    pub(crate) digest: Option<Digest>,
    /// Its length.
    pub(crate) bytes: u64,
    /// Warnings about data that the format could not store, or that it changed.
    pub(crate) warnings: Vec<Diagnostic>,
    /// Files that get their names together with it.
    beside: Vec<WrittenFile>,
    _writing: Option<WritingGuard>,
}

impl WrittenFile {
    /// Frees its buffer, for files that are renamed together with others.
    pub(crate) fn free_buffer(self) -> Result<Self, Failure> {
        let output = self.output.settle();
        Ok(Self {
            output: output.map_err(|error| Failure::output(&error))?,
            ..self
        })
    }

    /// The same, with another file that gets its name together with it.
    pub(crate) fn with(mut self, beside: Option<WrittenFile>) -> Self {
        self.beside.extend(beside);
        self
    }

    pub(crate) fn commit(self) -> Result<(), Failure> {
        self.output
            .commit()
            .map_err(|error| Failure::output(&error))?;
        self.beside.into_iter().try_for_each(Self::commit)
    }
}

impl Destination {
    /// Checks everything that can be checked without writing.
    pub(crate) fn new(path: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, Failure> {
        if !names::is_standard(path) {
            check_target(path, overwrite, inputs).map_err(|error| Failure::output(&error))?;
        }
        Ok(Self {
            path: path.to_owned(),
            below: None,
            overwrite,
            inputs: inputs.to_vec(),
            hashed: false,
            mark: String::new(),
        })
    }

    /// As [`Destination::new`], of one of the files below an open directory: if another directory or a link is put in
    /// its place, nothing is written there.
    pub(crate) fn below(
        folder: &Folder,
        name: &Path,
        overwrite: bool,
        inputs: &[PathBuf],
    ) -> Result<Self, Failure> {
        let destination = Self::new(&folder.path().join(name), overwrite, inputs)?;
        Ok(Self {
            below: Some((folder.clone(), name.to_owned())),
            ..destination
        })
    }

    /// The same for a picture, whose name says its format.
    pub(crate) fn of_picture(
        path: &Path,
        overwrite: bool,
        inputs: &[PathBuf],
    ) -> Result<Self, Failure> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        if extension != "svg" && extension != "png" {
            let path = path.display();
            let message = format!("{path}: end the picture in .svg or .png");
            return Err(Failure::usage(message));
        }
        Self::new(path, overwrite, inputs)
    }

    /// Refuses the destination of another file of the same command.
    pub(crate) fn refuse_same(&self, other: &Path) -> Result<(), Failure> {
        if self.is_standard() || !is_same(&self.path, other) {
            return Ok(());
        }
        let message = "would be written twice by this command; give each file a different name";
        Err(Failure::usage(format!("{self}: {message}")))
    }

    /// Refuses to write bytes that are not text to a terminal, which would interpret some of them
    /// as commands.
    pub(crate) fn refuse_terminal(&self, format: &Format) -> Result<(), Failure> {
        if format.is_text || !self.is_standard() || !io::stdout().is_terminal() {
            return Ok(());
        }
        Err(Failure::usage(
            "standard output is a terminal, and the result is binary; give -o FILE, or send it to a file or a \
             program",
        ))
    }

    /// The same destination with another name, which `rename` gives it.
    pub(crate) fn renamed(&self, rename: impl Fn(&Path) -> PathBuf) -> Result<Self, Failure> {
        let renamed = match &self.below {
            Some((folder, name)) => {
                Self::below(folder, &rename(name), self.overwrite, &self.inputs)
            }
            None => Self::new(&rename(&self.path), self.overwrite, &self.inputs),
        };
        Ok(Self {
            hashed: self.hashed,
            mark: self.mark.clone(),
            ..renamed?
        })
    }

    /// The same destination, with its bytes hashed.
    pub(crate) fn hashed(self) -> Self {
        Self {
            hashed: true,
            ..self
        }
    }

    /// The same destination, with `mark` in the name of its temporary file.
    pub(crate) fn marked(self, mark: &str) -> Self {
        let mark = mark.to_owned();
        Self { mark, ..self }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn is_standard(&self) -> bool {
        names::is_standard(&self.path)
    }

    /// Opens and drops the file: its directory may be read-only.
    pub(crate) fn check_writable(&self) -> Result<(), Failure> {
        let _writing = WritingGuard::begin();
        self.open().map(drop)
    }

    fn open(&self) -> Result<Output, Failure> {
        let opened = match &self.below {
            Some((folder, name)) => Output::create_in(folder, name, self.overwrite, &self.mark),
            None => Output::create(&self.path, self.overwrite, &self.inputs),
        };
        opened.map_err(|error| Failure::output(&error))
    }

    /// Runs `write`; a file appears under its name once it is whole.
    pub(crate) fn write(
        &self,
        progress: Option<MeasuredProgress>,
        write: impl FnOnce(&mut OutputStream) -> io::Result<()>,
    ) -> Result<(), Failure> {
        self.prepare(progress, write)?.commit()
    }

    /// As [`Destination::write`], without the final rename.
    pub(crate) fn prepare(
        &self,
        progress: Option<MeasuredProgress>,
        write: impl FnOnce(&mut OutputStream) -> io::Result<()>,
    ) -> Result<WrittenFile, Failure> {
        // Nothing has to be cleaned up on standard output, so a signal may end the program at once.
        let writing = (!self.is_standard()).then(WritingGuard::begin);
        let digest = self.hashed.then(Digest::default);
        let mut stream = OutputStream::new(self.open()?, progress, digest);
        // Flushing the buffer can fail too.
        let result = write(&mut stream).and_then(|()| stream.flush());
        let FinishedStream {
            output,
            digest,
            bytes,
            broken_pipe,
        } = stream.end();
        if let Some(stopped) = signals::stopped() {
            return Err(stopped);
        }
        match result {
            Ok(()) => Ok(WrittenFile {
                output,
                digest,
                bytes,
                warnings: Vec::new(),
                beside: Vec::new(),
                _writing: writing,
            }),
            Err(_) if broken_pipe => Err(Failure::quiet(BROKEN_PIPE)),
            Err(error) => Err(Failure::writing(&self.to_string(), &error)),
        }
    }
}

impl fmt::Display for Destination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_standard() {
            return f.write_str("standard output");
        }
        write!(f, "{}", self.path.display())
    }
}

/// Whether two paths name the same file, which need not exist.
fn is_same(one: &Path, other: &Path) -> bool {
    let real = |path: &Path| {
        let parent = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        Some(parent.canonicalize().ok()?.join(path.file_name()?))
    };
    one == other || real(one).is_some_and(|one| Some(one) == real(other))
}

/// Creates a directory for results if there is none. Other processes may create it at the same time:
/// shards start together.
pub(crate) fn create_folder(path: &Path) -> Result<(), Failure> {
    match std::fs::create_dir_all(path) {
        Err(error) if !path.is_dir() => {
            let path = path.display();
            let message = format!("{path}: the directory could not be made: {error}");
            Err(Failure::new(OUTPUT, message))
        }
        _ => Ok(()),
    }
}

/// Opens a directory of results, creating it if there is none.
pub(crate) fn open_folder(path: &Path) -> Result<Folder, Failure> {
    create_folder(path)?;
    opened(path)
}

/// Opens a directory of results that exists.
pub(crate) fn opened(path: &Path) -> Result<Folder, Failure> {
    Folder::open(path).map_err(|error| {
        let path = path.display();
        Failure::new(OUTPUT, format!("{path}: cannot be opened: {error}"))
    })
}

/// A progress bar, and a function that converts bytes to its progress.
pub(crate) type MeasuredProgress = (Progress, fn(&[u8]) -> u64);

/// The stream into an output. It stops after a signal, moves the progress bar, hashes the bytes if this is requested,
/// and records whether the reader has closed its end.
pub(crate) struct OutputStream {
    output: Output,
    progress: Option<MeasuredProgress>,
    digest: Option<Digest>,
    /// Bytes so far.
    bytes: u64,
    /// Kept here because writers wrap the error in another kind.
    broken_pipe: bool,
}

/// A stream that has ended.
struct FinishedStream {
    output: Output,
    digest: Option<Digest>,
    bytes: u64,
    /// The reader has closed the stream.
    broken_pipe: bool,
}

impl OutputStream {
    fn new(output: Output, progress: Option<MeasuredProgress>, digest: Option<Digest>) -> Self {
        Self {
            output,
            progress,
            digest,
            bytes: 0,
            broken_pipe: false,
        }
    }

    fn end(self) -> FinishedStream {
        FinishedStream {
            output: self.output,
            digest: self.digest,
            bytes: self.bytes,
            broken_pipe: self.broken_pipe,
        }
    }

    fn watch<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        self.broken_pipe |= result
            .as_ref()
            .is_err_and(|error| error.kind() == io::ErrorKind::BrokenPipe);
        result
    }
}

impl Write for OutputStream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if signals::stopped().is_some() {
            // Not `ErrorKind::Interrupted`, because callers repeat the call then.
            return Err(io::Error::other("stopped by a signal"));
        }
        let result = self.output.write(bytes);
        let written = self.watch(result)?;
        self.bytes += written as u64;
        if let Some(digest) = &mut self.digest {
            digest.update(&bytes[..written]);
        }
        if let Some((progress, measure)) = &mut self.progress {
            progress.advance(measure(&bytes[..written]));
        }
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.output.flush();
        self.watch(result)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    /// Shards that begin at the same time create the directory of their results at the same time.
    #[test]
    fn a_directory_may_be_made_by_many_at_once() {
        let directory = tempfile::tempdir().unwrap();
        let together = Barrier::new(4);
        for round in 0..200 {
            let path = directory.path().join(round.to_string());
            std::thread::scope(|scope| {
                for _ in 0..4 {
                    scope.spawn(|| {
                        together.wait();
                        assert!(create_folder(&path).is_ok());
                    });
                }
            });
        }
        assert!(create_folder(&directory.path().join("several/at/once")).is_ok());
        std::fs::write(directory.path().join("file"), "").unwrap();
        assert!(create_folder(&directory.path().join("file/below")).is_err());
    }
}
