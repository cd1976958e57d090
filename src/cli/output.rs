//! Outputs: planned and checked before any work, written whole or not at all.

use std::collections::{HashMap, HashSet};
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use glam::Quat;
use tumble::formats::csv::write_csv;
use tumble::formats::npy::{ComponentOrder, NpyWriter};
use tumble::formats::output::{Output, check_target};
use tumble::{Layout, Rotations, Timeline, TrackSet};

use super::exit::{BROKEN_PIPE, Failure, OUTPUT};
use super::progress::Progress;
use super::signals::{self, Writing};
use super::stream::{Measured, Stream};
use super::{input, room};

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// NumPy's, float32
    Npy,
    /// text, a row for each frame
    Csv,
    /// Keyframes.
    #[value(skip)]
    Dat,
}

/// Rotations handed to a writer at once: 4 MB, so that a signal is noticed soon.
const CHUNK: usize = 1 << 18;

/// Where one result goes.
#[derive(Debug)]
pub(crate) struct Target {
    path: PathBuf,
    format: Format,
    overwrite: bool,
    /// Files that it must not be.
    inputs: Vec<PathBuf>,
}

/// One target for each input. Refuses what cannot be meant, before any work:
/// outputs that exist, that are inputs, that two inputs share.
pub(crate) fn plan(
    inputs: &[PathBuf],
    output: Option<&Path>,
    format: Option<Format>,
    overwrite: bool,
) -> Result<Vec<Target>, Failure> {
    if output.is_none() && io::stdout().is_terminal() {
        return Err(Failure::usage(
            "where should the result go? give -o OUT.npy, -o OUT.csv, or -o - for standard output",
        ));
    }
    let output = output.unwrap_or(Path::new("-"));
    let targets = match inputs {
        [_] => vec![Target::new(
            output,
            choose(output, format)?,
            overwrite,
            inputs,
        )?],
        _ if input::is_standard(output) => {
            return Err(Failure::usage(
                "several inputs need a directory for their results: -o DIRECTORY",
            ));
        }
        _ => in_folder(inputs, output, format, overwrite)?,
    };
    // The surest check is to try; they are all in one directory.
    if let Some(target) = targets.first() {
        target.try_out()?;
    }
    Ok(targets)
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

/// A file in `folder` for each input, named after it.
fn in_folder(
    inputs: &[PathBuf],
    folder: &Path,
    format: Option<Format>,
    overwrite: bool,
) -> Result<Vec<Target>, Failure> {
    let shown = folder.display();
    let exists = folder.is_dir();
    if !exists && (folder.exists() || Format::of(folder).is_some()) {
        return Err(Failure::usage(format!(
            "{shown}: several inputs need a directory for their results, not one file"
        )));
    }
    let format = format.unwrap_or(Format::Npy);
    let sources: HashSet<PathBuf> = inputs
        .iter()
        .filter_map(|input| input.canonicalize().ok())
        .collect();
    let mut owners: HashMap<PathBuf, &Path> = HashMap::new();
    let mut paths = Vec::new();
    for path in inputs {
        let target = folder.join(format.name_for(path));
        if let Some(other) = owners.insert(target.clone(), path) {
            return Err(Failure::usage(format!(
                "{} and {} would both write {}; evaluate them into different directories",
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
        paths.push(target);
    }
    if !exists {
        std::fs::create_dir(folder).map_err(|error| {
            Failure::new(
                OUTPUT,
                format!("{shown}: the directory could not be made: {error}"),
            )
        })?;
    }
    paths
        .iter()
        .map(|path| Target::new(path, format, overwrite, &[]))
        .collect()
}

impl Format {
    fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_lowercase().as_str() {
            "npy" => Some(Self::Npy),
            "csv" => Some(Self::Csv),
            _ => None,
        }
    }

    /// `folder/walk.dat` becomes `walk.npy`.
    fn name_for(self, input: &Path) -> PathBuf {
        let standard = input::is_standard(input);
        let stem = if standard {
            Some("stdin".as_ref())
        } else {
            input.file_stem()
        };
        let mut name = stem.unwrap_or_default().to_owned();
        name.push(match self {
            Self::Npy => ".npy",
            Self::Csv => ".csv",
            Self::Dat => ".dat",
        });
        name.into()
    }

    /// The least that a component takes.
    fn component_bytes(self) -> f64 {
        match self {
            Self::Npy => size_of::<f32>() as f64,
            Self::Csv | Self::Dat => 2.0, // a digit and a comma
        }
    }
}

impl Target {
    /// Checks everything that can be checked without writing.
    pub(crate) fn new(
        path: &Path,
        format: Format,
        overwrite: bool,
        inputs: &[PathBuf],
    ) -> Result<Self, Failure> {
        if !input::is_standard(path) {
            check_target(path, overwrite, inputs).map_err(|error| Failure::output(&error))?;
        }
        Ok(Self {
            path: path.to_owned(),
            format,
            overwrite,
            inputs: inputs.to_vec(),
        })
    }

    pub(crate) fn format(&self) -> Format {
        self.format
    }

    /// Opens and drops the output: its directory may be read-only.
    fn try_out(&self) -> Result<(), Failure> {
        let _writing = Writing::begin();
        self.open().map(drop)
    }

    fn open(&self) -> Result<Output, Failure> {
        Output::create(&self.path, self.overwrite, &self.inputs)
            .map_err(|error| Failure::output(&error))
    }

    /// Refuses a result for which the disk has no room.
    pub(crate) fn has_room(
        &self,
        name: &str,
        tracks: usize,
        samples: usize,
    ) -> Result<(), Failure> {
        if input::is_standard(&self.path) {
            return Ok(());
        }
        let bytes = tracks as f64 * samples as f64 * 4.0 * self.format.component_bytes();
        let folder = match self.path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        room::on_disk(name, (tracks, samples), bytes, folder)
    }

    /// Runs `write`; a file appears under its name once it is whole.
    pub(crate) fn write(
        &self,
        progress: Option<Measured>,
        write: impl FnOnce(&mut Stream) -> io::Result<()>,
    ) -> Result<(), Failure> {
        // Standard output has nothing to clean up: a signal may end it at once.
        let _writing = (!input::is_standard(&self.path)).then(Writing::begin);
        let mut stream = Stream::new(self.open()?, progress);
        // What a buffer still holds can fail too.
        let result = write(&mut stream).and_then(|()| stream.flush());
        let (output, broken_pipe) = stream.into_output();
        if let Some(stopped) = signals::stopped() {
            return Err(stopped);
        }
        match result {
            Ok(()) => output.commit().map_err(|error| Failure::output(&error)),
            Err(_) if broken_pipe => Err(Failure::quiet(BROKEN_PIPE)),
            Err(error) => Err(Failure::writing(&self.to_string(), &error)),
        }
    }

    /// Writes one result.
    pub(crate) fn write_rotations(
        &self,
        set: &TrackSet,
        timeline: &Timeline,
        rotations: &Rotations,
        order: ComponentOrder,
    ) -> Result<(), Failure> {
        let (tracks, samples) = (rotations.tracks(), rotations.samples());
        if self.format == Format::Csv {
            let lines: fn(&[u8]) -> u64 =
                |bytes| bytes.iter().filter(|&&byte| byte == b'\n').count() as u64;
            let progress = Progress::new("writing", samples as u64 + 1);
            return self.write(Some((progress, lines)), |out| {
                write_csv(out, set, timeline, rotations)
            });
        }
        let (rows, columns) = match rotations.layout() {
            Layout::TrackMajor => (tracks, samples),
            Layout::FrameMajor => (samples, tracks),
        };
        let bytes: fn(&[u8]) -> u64 = |bytes| bytes.len() as u64;
        let progress = Progress::new("writing", (rows * columns * size_of::<Quat>()) as u64);
        self.write(Some((progress, bytes)), |out| {
            let mut npy = NpyWriter::new(out, rows, columns, order)?;
            for chunk in rotations.as_quats().chunks(CHUNK) {
                npy.write(chunk)?;
            }
            npy.finish().map(drop)
        })
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if input::is_standard(&self.path) {
            return f.write_str("standard output");
        }
        write!(f, "{}", self.path.display())
    }
}
