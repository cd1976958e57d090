//! `tumble.load` and `tumble.File`: the clips of a file.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use pyo3::exceptions::{PyException, PyIndexError, PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use tumble::names::counted;
use tumble_formats::adjust::{JointOffsets, OffsetsError, UpAxis, adjust_all, set_all_offsets};
use tumble_formats::format::FormatOption;
use tumble_formats::keys::Duplicates;
use tumble_formats::kitti::open_frame_times;
use tumble_formats::motion::Motion;
use tumble_formats::npz::body_offsets;
use tumble_formats::{Diagnostic, Format, Limits, Loaded, ReadOptions};

use crate::arrays::{ListArgument, doubles};
use crate::clip::{Clip, Source};
use crate::clip_shape::ClipShape;
use crate::errors::{expected, guarded, input, of_diagnostic, of_track, warn};
use crate::names::{one_of, option_of, unknown_name};
use crate::options::frame_rate;
use crate::run::interruptible;

/// The clips of a file, by their indices or names.
///
/// >>> import tumble, tempfile, os
/// >>> path = os.path.join(tempfile.mkdtemp(), "door.tum")
/// >>> tumble.save(path, tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]]))
/// >>> file = tumble.load(path)
/// >>> len(file), file.clip
/// (1, Clip(1 track, 2 keys, 0 to 1 s, 1 fps))
#[pyclass(frozen, eq, weakref, module = "tumble", mapping)]
pub(crate) struct File {
    clips: Vec<Clip>,
    path: PathBuf,
    refused: Vec<String>,
}

impl PartialEq for File {
    /// Whether both files have equal clips and equal errors of unreadable clips. Their paths may differ.
    fn eq(&self, other: &Self) -> bool {
        self.clips == other.clips && self.reasons().eq(other.reasons())
    }
}

impl File {
    /// The errors of clips that could not be read, without the path at the beginning.
    fn reasons(&self) -> impl Iterator<Item = &str> {
        let path = self.path.display().to_string();
        let texts = self.refused.iter();
        texts.map(move |text| text.strip_prefix(&path).unwrap_or(text))
    }
}

#[pymethods]
impl File {
    /// The clips, in the file's order.
    #[getter]
    fn clips(&self) -> Vec<Clip> {
        self.clips.clone()
    }

    /// The clips' names; their indices where they have none.
    #[getter]
    fn names(&self) -> Vec<String> {
        let name = |clip: &Clip| {
            let motion = &clip.motion;
            motion
                .name
                .clone()
                .unwrap_or_else(|| motion.index.to_string())
        };
        self.clips.iter().map(name).collect()
    }

    /// The only clip; an error where there are several.
    #[getter]
    fn clip(&self) -> PyResult<Clip> {
        match &*self.clips {
            [clip] => Ok(clip.clone()),
            [] => Err(input(format!("{}: has no clips", self.path.display()))),
            clips => {
                let names = self.names();
                Err(input(format!(
                    "{}: has {}: {}; choose one by its name or index: `file[{:?}]` or `file[0]`",
                    self.path.display(),
                    counted(clips.len(), "clip"),
                    names.join(", "),
                    names[0]
                )))
            }
        }
    }

    /// The path of the file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// Why other clips of the file could not be read.
    #[getter]
    fn refused(&self) -> Vec<String> {
        self.refused.clone()
    }

    /// A hash; files that are equal (`==`) have the same.
    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.names(), self.refused.len()).hash(&mut hasher);
        hasher.finish()
    }

    /// Pickles the clips, each as a `Clip` is pickled.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, file) = (slf.py(), slf.get());
        let again = py.import("tumble._tumble")?.getattr("file_of_state")?;
        let state = (file.path.clone(), file.clips.clone(), file.refused.clone());
        PyTuple::new(py, [again, state.into_pyobject(py)?.into_any()])
    }

    /// Returns the file itself: files are immutable.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __len__(&self) -> usize {
        self.clips.len()
    }

    fn __iter__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let clips = slf.get().clips().into_pyobject(slf.py())?;
        Ok(clips.try_iter()?.into_any())
    }

    fn __contains__(&self, name: &str) -> bool {
        self.names().iter().any(|known| known == name)
    }

    fn __getitem__(&self, key: &Bound<'_, PyAny>) -> PyResult<Clip> {
        if let Ok(name) = key.cast::<PyString>() {
            let name = name.to_cow()?;
            let index = self.names().iter().position(|known| *known == *name);
            return index.map(|index| self.clips[index].clone()).ok_or_else(|| {
                let names = self.names();
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                let refusal = format!("there is no clip `{name}`");
                PyKeyError::new_err(unknown_name(&refusal, &name, &names))
            });
        }
        let index: isize = key.extract().map_err(|error| {
            expected(key.py(), error, || {
                "give a clip as its index, from 0, or its name".to_owned()
            })
        })?;
        let from_end = if index < 0 {
            self.clips.len() as isize
        } else {
            0
        };
        let clip = usize::try_from(index + from_end)
            .ok()
            .and_then(|index| self.clips.get(index));
        clip.cloned().ok_or_else(|| {
            PyIndexError::new_err(format!(
                "there is no clip {index}; there are {}",
                self.clips.len()
            ))
        })
    }

    fn __repr__(&self) -> String {
        let clips: Vec<String> = self
            .names()
            .iter()
            .map(|name| format!("{name:?}"))
            .collect();
        format!(
            "File({:?}: {})",
            self.path.display().to_string(),
            clips.join(", ")
        )
    }
}

/// Reads a motion file of any format (docs/formats.md lists them). An invalid file raises an `InputError` with the
/// position of the error; oddities are reported as `InputWarning`.
///
/// * `format`: the file's format; by default it is recognised by its first bytes and its name.
/// * `source_fps`: the frame rate of a file that states neither times nor a rate.
/// * `override_fps`: the frame rate of an NPZ or BVH file without times, instead of the rate that the file states.
/// * `source_times`: for KITTI, a text file of times, one time in seconds per line.
/// * `time_unit`: the unit of times that are whole numbers: "s", "ms", "us" or "ns".
/// * `source_order`: the order of a quaternion's components in TUM and EuRoC files that do not follow their format:
///   "xyzw" or "wxyz".
/// * `map`: the contents of arrays or columns, if their names do not say it, such as "rotations=keys:wxyz,time=t". It
///   has entries NAME=SOURCE, separated by commas. NAME is `rotations`, `translations` or `time` for arrays, and a
///   known column or a track for tables. SOURCE is an array, a column, a part of a list such as `state[3:7]`, or a
///   range of columns `rx..rz`; a suffix such as `:wxyz`, `:rotvec` or `:ZXY` gives the representation of rotations.
///   Known columns are `time`, `track` (or `joint`, `body`), `clip` (`clip_id`, `motion_id`), `x y z w` or `qx qy qz
///   qw`, `tx ty tz`, `sx sy sz`.
/// * `duplicates`: which of two different keys at the same time to keep: "first", "last" or "both", which makes a jump.
/// * `raw_times`: keep times as stored, instead of moving them to exact frame times.
/// * `bridge_gaps`: skip keys with missing numbers in a table, a trajectory or a log, instead of refusing the file.
/// * `keyframes`: read only the keys that an FBX file has; by default, keys are added until its curves are followed.
/// * `offsets`: for files that do not store them, such as those of AMASS: the positions of joints relative to their
///   parents, (joints, 3), or a dict of x, y, z by the names of joints. Offsets in the file are replaced, with a
///   warning.
/// * `body_model`: computes the offsets from a model of SMPL, SMPL-H or SMPL-X as NPZ, or from a folder with one per
///   gender.
/// * `scale`: a factor for translations and the length of boxes; "metres" converts from the unit that an FBX file
///   states.
/// * `up`: rotate so that "y" or "z" is up, from the up axis that an FBX file states, otherwise from the other of the
///   two.
///
/// `read` is the same function.
///
/// >>> import tumble
/// >>> tumble.load("missing.glb")  # doctest: +IGNORE_EXCEPTION_DETAIL
/// Traceback (most recent call last):
/// tumble.MissingFileError: missing.glb: error[E001]: ...
#[pyfunction]
#[pyo3(signature = (
    path, *, format=None, source_fps=None, override_fps=None, source_times=None, map=None, time_unit=None,
    source_order=None, duplicates=None, raw_times=false, bridge_gaps=false, keyframes=false, offsets=None,
    body_model=None, scale=None, up=None
))]
#[allow(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn load(
    py: Python<'_>,
    path: PathBuf,
    format: Option<&str>,
    source_fps: Option<&Bound<'_, PyAny>>,
    override_fps: Option<&Bound<'_, PyAny>>,
    source_times: Option<PathBuf>,
    map: Option<String>,
    time_unit: Option<&Bound<'_, PyAny>>,
    source_order: Option<&Bound<'_, PyAny>>,
    duplicates: Option<&Bound<'_, PyAny>>,
    raw_times: bool,
    bridge_gaps: bool,
    keyframes: bool,
    offsets: Option<&Bound<'_, PyAny>>,
    body_model: Option<PathBuf>,
    scale: Option<&Bound<'_, PyAny>>,
    up: Option<&Bound<'_, PyAny>>,
) -> PyResult<File> {
    let keywords = LoadKeywords {
        format: format.map(str::to_owned),
        source_fps: source_fps.cloned(),
        override_fps: override_fps.cloned(),
        source_times,
        map,
        time_unit: time_unit.cloned(),
        source_order: source_order.cloned(),
        duplicates: duplicates.cloned(),
        raw_times,
        bridge_gaps,
        keyframes,
        offsets: offsets.cloned(),
        body_model,
        scale: scale.cloned(),
        up: up.cloned(),
    };
    let (file, warnings) = FileOptions::new(keywords)?.read(py, path)?;
    warn(py, &warnings)?;
    Ok(file)
}

/// A file that could not be read: its path, the code of the error, and the message.
type SkippedFile = (PathBuf, Option<String>, String);

/// Reads files of any format, as `load` does with the same keywords, on all threads, and warns once for each code: what
/// `MotionLibrary.load` does. `skip`: files that cannot be read are left out and returned. `progress` is called with the
/// number of files that were read and of all, now and then and at the end. `fps`, `tracks`, `collapse` and
/// `method`: each clip is shaped as by `shaped`.
#[pyfunction]
#[pyo3(signature = (
    paths, keywords, *, skip=false, progress=None, fps=None, tracks=None, collapse=false, method="slerp"
))]
#[allow(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn load_all(
    py: Python<'_>,
    paths: ListArgument<PathBuf>,
    keywords: &Bound<'_, PyDict>,
    skip: bool,
    progress: Option<&Bound<'_, PyAny>>,
    fps: Option<&Bound<'_, PyAny>>,
    tracks: Option<&Bound<'_, PyAny>>,
    collapse: bool,
    method: &str,
) -> PyResult<(Vec<File>, Vec<SkippedFile>)> {
    let mut request = FileOptions::new(LoadKeywords::of_dict(keywords)?)?;
    request.shape = ClipShape::new(fps, tracks, collapse, method)?;
    request.options.tracks = request.shape.selection();
    let request = Arc::new(request);
    let (mut files, mut skipped) = (Vec::with_capacity(paths.0.len()), Vec::new());
    let mut warnings = Vec::new();
    for (chunk, paths_read) in paths.0.chunks(FILES_AT_ONCE).enumerate() {
        let (reading, several) = (Arc::clone(&request), paths_read.to_vec());
        let found = interruptible(py, move || Ok(reading.read_several(&several)))?;
        for (path, loaded) in paths_read.iter().zip(found) {
            match loaded.and_then(|loaded| request.file(path.clone(), loaded)) {
                Ok((file, of_file)) => {
                    files.push(file);
                    warnings.extend(of_file);
                }
                Err(error) if skip && error.is_instance_of::<PyException>(py) => {
                    let value = error.value(py);
                    let code = value.getattr_opt("code")?;
                    let code = code.map(|code| code.extract()).transpose()?;
                    let message = value.str()?.to_string();
                    skipped.push((path.clone(), code.flatten(), message));
                }
                Err(error) => return Err(error),
            }
        }
        if let Some(progress) = progress {
            progress.call1((chunk * FILES_AT_ONCE + paths_read.len(), paths.0.len()))?;
        }
    }
    warn(py, &warnings)?;
    Ok((files, skipped))
}

/// The number of files that are read between two calls of `progress`.
const FILES_AT_ONCE: usize = 64;

/// The keywords of `load`.
#[derive(Default)]
struct LoadKeywords<'py> {
    format: Option<String>,
    source_fps: Option<Bound<'py, PyAny>>,
    override_fps: Option<Bound<'py, PyAny>>,
    source_times: Option<PathBuf>,
    map: Option<String>,
    time_unit: Option<Bound<'py, PyAny>>,
    source_order: Option<Bound<'py, PyAny>>,
    duplicates: Option<Bound<'py, PyAny>>,
    raw_times: bool,
    bridge_gaps: bool,
    keyframes: bool,
    offsets: Option<Bound<'py, PyAny>>,
    body_model: Option<PathBuf>,
    scale: Option<Bound<'py, PyAny>>,
    up: Option<Bound<'py, PyAny>>,
}

/// The names of [`LoadKeywords`].
const LOAD_KEYWORDS: [&str; 15] = [
    "format",
    "source_fps",
    "override_fps",
    "source_times",
    "map",
    "time_unit",
    "source_order",
    "duplicates",
    "raw_times",
    "bridge_gaps",
    "keyframes",
    "offsets",
    "body_model",
    "scale",
    "up",
];

impl<'py> LoadKeywords<'py> {
    fn of_dict(keywords: &Bound<'py, PyDict>) -> PyResult<Self> {
        let mut all = Self::default();
        for (name, value) in keywords {
            let name: String = name.extract()?;
            if value.is_none() && LOAD_KEYWORDS.contains(&&*name) {
                continue;
            }
            match &*name {
                "format" => all.format = value.extract()?,
                "source_fps" => all.source_fps = Some(value),
                "override_fps" => all.override_fps = Some(value),
                "source_times" => all.source_times = value.extract()?,
                "map" => all.map = value.extract()?,
                "time_unit" => all.time_unit = Some(value),
                "source_order" => all.source_order = Some(value),
                "duplicates" => all.duplicates = Some(value),
                "raw_times" => all.raw_times = value.extract()?,
                "bridge_gaps" => all.bridge_gaps = value.extract()?,
                "keyframes" => all.keyframes = value.extract()?,
                "offsets" => all.offsets = Some(value),
                "body_model" => all.body_model = value.extract()?,
                "scale" => all.scale = Some(value),
                "up" => all.up = Some(value),
                _ => {
                    let refusal = format!("there is no keyword `{name}`");
                    let message = unknown_name(&refusal, &name, &LOAD_KEYWORDS);
                    return Err(PyTypeError::new_err(message));
                }
            }
        }
        Ok(all)
    }
}

/// The options of reading a file.
#[derive(Clone, Default)]
struct FileOptions {
    format: Option<&'static Format>,
    options: ReadOptions,
    source_times: Option<PathBuf>,
    offsets: Option<JointOffsets>,
    body_model: Option<PathBuf>,
    scale: Option<Scale>,
    up: Option<UpAxis>,
    /// Whether options change the keys, so that they differ from those in the file.
    is_changed: bool,
    shape: ClipShape,
}

impl FileOptions {
    /// Reads the options from the keywords of `load`.
    fn new(keywords: LoadKeywords<'_>) -> PyResult<Self> {
        let LoadKeywords {
            format,
            source_fps,
            override_fps,
            source_times,
            map,
            time_unit,
            source_order,
            duplicates,
            raw_times,
            bridge_gaps,
            keyframes,
            offsets,
            body_model,
            scale,
            up,
        } = keywords;
        let options = [
            ("source_fps", source_fps.is_some()),
            ("override_fps", override_fps.is_some()),
            ("source_times", source_times.is_some()),
        ];
        let mut named = options.iter().filter(|(_, is_named)| *is_named);
        if let (Some((first, _)), Some((second, _))) = (named.next(), named.next()) {
            return Err(input(format!(
                "{first} and {second} both say when the keys are; give one"
            )));
        }
        let is_changed = source_fps.is_some()
            || override_fps.is_some()
            || source_times.is_some()
            || map.is_some()
            || time_unit.is_some()
            || source_order.is_some()
            || duplicates.is_some()
            || bridge_gaps
            || keyframes
            || offsets.is_some()
            || body_model.is_some();
        let options = ReadOptions {
            limits: Limits::default(),
            pipes: false,
            raw_times,
            duplicates: match duplicates {
                None => Duplicates::Refuse,
                Some(which) => one_of(
                    &which,
                    "duplicates",
                    &[
                        ("first", Duplicates::First),
                        ("last", Duplicates::Last),
                        ("both", Duplicates::Both),
                    ],
                )?,
            },
            source_rate: source_fps.as_ref().map(frame_rate).transpose()?,
            override_rate: override_fps.as_ref().map(frame_rate).transpose()?,
            frame_times: None,
            map,
            time_unit: time_unit
                .map(|unit| option_of(&unit, "time_unit"))
                .transpose()?,
            source_order: source_order
                .map(|order| option_of(&order, "source_order"))
                .transpose()?,
            bridge_gaps,
            keyframes,
            has_body_model: body_model.is_some(),
            tracks: None,
            with_partners: false,
        };
        let format = format.as_deref().map(format_named).transpose()?;
        let up: Option<UpAxis> = up.map(|axis| option_of(&axis, "up")).transpose()?;
        let scale = scale.as_ref().map(Scale::of).transpose()?;
        if offsets.is_some() && body_model.is_some() {
            return Err(input(
                "offsets and body_model both place the joints; give one",
            ));
        }
        let offsets = offsets.as_ref().map(joint_offsets).transpose()?;
        Ok(Self {
            format,
            options,
            source_times,
            offsets,
            body_model,
            scale,
            up,
            is_changed,
            shape: ClipShape::default(),
        })
    }

    /// Reads a file; also returns the warnings about it.
    fn read(self, py: Python<'_>, path: PathBuf) -> PyResult<(File, Vec<Diagnostic>)> {
        let request = Arc::new(self);
        let (reading, file) = (Arc::clone(&request), path.clone());
        let loaded = interruptible(py, move || reading.loaded(&file))?;
        request.file(path, loaded)
    }

    /// Reads files on all threads.
    fn read_several(&self, paths: &[PathBuf]) -> Vec<PyResult<Loaded>> {
        let next = AtomicUsize::new(0);
        let read = || {
            let mut read = Vec::new();
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(path) = paths.get(index) else {
                    return read;
                };
                let loaded = guarded(|| self.loaded(path));
                read.push((
                    index,
                    loaded.map(|mut loaded| {
                        // These clips are not saved, so the other contents of their files are not kept.
                        loaded.document = None;
                        loaded
                    }),
                ));
            }
        };
        let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
        let mut found = std::thread::scope(|scope| {
            let others: Vec<_> = (1..threads.min(paths.len()))
                .map(|_| scope.spawn(read))
                .collect();
            let mut found = read();
            found.extend(
                others
                    .into_iter()
                    .filter_map(|other| other.join().ok())
                    .flatten(),
            );
            found
        });
        found.sort_by_key(|(index, _)| *index);
        found.into_iter().map(|(_, loaded)| loaded).collect()
    }

    /// The file, and the warnings about it.
    fn file(&self, path: PathBuf, mut loaded: Loaded) -> PyResult<(File, Vec<Diagnostic>)> {
        if let ([], Some(first)) = (&*loaded.clips, loaded.refused.first()) {
            return Err(of_diagnostic(first));
        }
        let warnings = loaded.warnings.iter().chain(&loaded.refused);
        let warnings = warnings.cloned().collect();
        let is_changed = self.is_changed || self.shape != ClipShape::default();
        Ok((File::new(path, &mut loaded, is_changed), warnings))
    }

    fn loaded(&self, file: &Path) -> PyResult<Loaded> {
        let mut options = self.options.clone();
        if let Some(times) = &self.source_times {
            let times = open_frame_times(times, Limits::default());
            let times = times.map_err(|diagnostic| of_diagnostic(&diagnostic))?;
            options.frame_times = Some(Arc::new(times));
        }
        let format = self.format.unwrap_or_else(|| Format::detected(file));
        if options.override_rate.is_some() && !format.takes(FormatOption::OverrideRate) {
            return Err(input(format!(
                "override_fps has no effect on {}; it is for {}; leave it out",
                format.name,
                Format::names_taking(FormatOption::OverrideRate)
            )));
        }
        let read = format.open(file, &options);
        let mut loaded = read.map_err(|diagnostic| of_diagnostic(&diagnostic))?;
        let name = file.display().to_string();
        let refuse = |fault: String| input(format!("{name}: {fault}"));
        let are_of_selected = match (&self.offsets, loaded.clips.first()) {
            (Some(offsets), Some(clip)) => self.shape.selects_offsets(offsets, clip),
            _ => Ok(false),
        };
        let are_of_selected =
            are_of_selected.map_err(|fault| input(format!("offsets: {name}: {fault}")))?;
        if let (Some(offsets), false) = (&self.offsets, are_of_selected) {
            put_offsets(&mut loaded, &name, |clip| offsets.of_clip(clip))?;
        }
        if let Some(model) = &self.body_model {
            let of_clip = |clip| body_offsets(model, clip, Limits::default());
            let of_clips: Result<Vec<Vec<f64>>, Diagnostic> =
                loaded.clips.iter().map(of_clip).collect();
            let numbers = of_clips.map_err(|diagnostic| of_diagnostic(&diagnostic))?;
            let placed = set_all_offsets(&mut loaded, &name, &numbers);
            placed.map_err(|error| input(format!("body_model: {name}: {error}")))?;
        }
        if self.shape.selection().is_some() {
            loaded.document = None;
            for clip in &mut loaded.clips {
                *clip = self.shape.selected(std::mem::take(clip)).map_err(refuse)?;
            }
        }
        if let (Some(offsets), true) = (&self.offsets, are_of_selected) {
            put_offsets(&mut loaded, &name, |clip| {
                offsets.some_of(clip).of_clip(clip)
            })?;
        }
        if self.scale.is_some() || self.up.is_some() {
            let factor = match (self.scale, loaded.space) {
                (None, _) => 1.0,
                (Some(Scale::Factor(factor)), _) => factor,
                (Some(Scale::Metres), Some(space)) => space.metres,
                (Some(Scale::Metres), None) => {
                    let message = "scale: the file does not say its unit; give a number";
                    return Err(input(message));
                }
            };
            adjust_all(&mut loaded, factor, self.up).map_err(|error| of_track(&error))?;
        }
        if self.shape != ClipShape::default() {
            loaded.document = None;
            for clip in &mut loaded.clips {
                *clip = self.shape.sampled(std::mem::take(clip)).map_err(refuse)?;
            }
        }
        Ok(loaded)
    }
}

/// Sets the offsets of the joints of all clips of a file.
fn put_offsets(
    loaded: &mut Loaded,
    name: &str,
    offsets: impl Fn(&Motion) -> Result<Vec<f64>, OffsetsError>,
) -> PyResult<()> {
    let of_clips: Result<Vec<Vec<f64>>, OffsetsError> = loaded.clips.iter().map(offsets).collect();
    let placed = of_clips.and_then(|numbers| set_all_offsets(loaded, name, &numbers));
    placed.map_err(|error| input(format!("offsets: {name}: {error}")))
}

/// The offsets of joints: an array in their order, or a dict by their names.
fn joint_offsets(value: &Bound<'_, PyAny>) -> PyResult<JointOffsets> {
    if let Ok(by_name) = value.cast::<PyDict>() {
        let joints = by_name.iter().map(|(name, offset)| {
            let (name, offset): (String, [f64; 3]) = (name.extract()?, offset.extract()?);
            Ok((name, offset))
        });
        let joints: PyResult<Vec<(String, [f64; 3])>> = joints.collect();
        let joints = joints.map_err(|error| {
            expected(value.py(), error, || {
                "offsets: give x, y, z for each name of a joint".to_owned()
            })
        });
        return joints.map(JointOffsets::named);
    }
    let offsets = doubles(value, "offsets")?;
    match offsets.shape.get(1) {
        Some(3) => Ok(JointOffsets::in_order(offsets.values)),
        _ => Err(input(format!(
            "offsets: the shape is {:?}; give (joints, 3), or a dict of x, y, z by the names of joints",
            offsets.shape
        ))),
    }
}

/// The factor for translations: the keyword `scale`.
#[derive(Debug, Clone, Copy)]
enum Scale {
    Factor(f64),
    /// The factor that converts the file's unit to metres.
    Metres,
}

impl Scale {
    fn of(scale: &Bound<'_, PyAny>) -> PyResult<Self> {
        if scale.is_instance_of::<PyString>() {
            return one_of(scale, "scale", &[("metres", Self::Metres)]);
        }
        match scale.extract::<f64>()? {
            factor if factor.is_finite() && factor > 0.0 => Ok(Self::Factor(factor)),
            factor => Err(input(format!(
                "scale: {factor} is not a number greater than 0"
            ))),
        }
    }
}

impl File {
    /// `is_changed`: options changed the keys, so that they differ from those in the file.
    fn new(path: PathBuf, loaded: &mut Loaded, is_changed: bool) -> Self {
        let source = Arc::new(Source {
            path: path.clone(),
            document: loaded.document.take(),
            clips: loaded.clips.len() + loaded.refused.len(),
            box_length: loaded.box_length,
            warnings: loaded.warnings.clone(),
            adjustment: loaded.adjustment,
            is_changed,
        });
        let clip = |motion| Clip {
            motion: Arc::new(motion),
            source: Some(Arc::clone(&source)),
        };
        Self {
            clips: loaded.clips.drain(..).map(clip).collect(),
            path,
            refused: loaded.refused.iter().map(ToString::to_string).collect(),
        }
    }
}

/// Makes the `File` of these clips.
#[pyfunction]
pub(crate) fn file_of_state(path: PathBuf, clips: Vec<Clip>, refused: Vec<String>) -> File {
    File {
        clips,
        path,
        refused,
    }
}

/// The format with this name.
pub(crate) fn format_named(name: &str) -> PyResult<&'static Format> {
    Format::named(name).ok_or_else(|| {
        let names: Vec<&str> = tumble_formats::FORMATS.iter().map(|it| it.name).collect();
        let refusal = format!("there is no format `{name}`");
        input(unknown_name(&refusal, name, &names))
    })
}
