//! `tumble.Clip`: keyed tracks, from arrays or from a file.

mod methods;

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::exceptions::{PyIndexError, PyKeyError};
use pyo3::prelude::*;
use pyo3::types::PyString;
use tumble_formats::Diagnostic;
use tumble_formats::format::{Adjustment, Document};
use tumble_formats::motion::Motion;

use crate::errors::expected;

/// Tracks of rotation keys, with names, a skeleton, translations and scales where there are any.
///
/// `Clip(times, keys, *, order="xyzw", layout=None, name=None, names=None, parents=None, offsets=None,
/// translations=None, scales=None, velocities=None, tangents=None, tcb=None, scalars=None)`
///
/// `times` are seconds, increasing: `(keys,)` for all tracks, `(tracks, keys)`, or a list with an array for each
/// track. `keys` are unit quaternions: `(keys, 4)` for one track, `(tracks, keys, 4)`, or a list with an array
/// `(keys, 4)` for each track; or SciPy's `Rotation`, or a list of them. `order` is the order of the four
/// components of `keys`. `layout`: "frame" for arrays of shape `(frames, tracks, …)`, "track" for `(tracks, keys,
/// …)`; it is needed only if there are as many tracks as keys.
///
/// Unix times are stored relative to the clip's `time_offset`, the whole second before the first key, so that no digits
/// are lost. `at`, `start` and `end` accept both.
///
/// For each track: `names`, text; `parents`, the index of its parent track (`None` or -1 for a root); `offsets`,
/// `(tracks, 3)`, its rest position in its parent's frame. For each key, as arrays or lists like `keys` with 3
/// components instead of 4: `translations` and `scales`. Some methods use further data: `velocities` (rad/s, body
/// frame; `hermite`), `tangents` (`(…, 2, 4)`, before and after each key, per second; `gltf-cubic`), `tcb`
/// (tension, continuity, bias; `kochanek-bartels`).
///
/// `scalars` are numbers over time beside the tracks, such as the angles of a robot's joints: a dict with a pair
/// `(times, keys)` for each name.
///
/// >>> import numpy as np, tumble
/// >>> half = np.sqrt(0.5)
/// >>> clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, half, half]], names=["door"])
/// >>> clip
/// Clip(1 track, 2 keys, 0 to 1 s)
/// >>> clip.evaluate(fps=2, method="slerp").shape
/// (1, 3, 4)
#[pyclass(frozen, eq, weakref, from_py_object, module = "tumble")]
#[derive(Clone)]
pub(crate) struct Clip {
    pub(crate) motion: Arc<Motion>,
    pub(crate) source: Option<Arc<Source>>,
}

/// The file that a clip was read from.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub(crate) path: PathBuf,
    pub(crate) document: Option<Arc<dyn Document>>,
    /// The number of clips in the file, including those that cannot be read.
    pub(crate) clips: usize,
    pub(crate) box_length: Option<f64>,
    /// The warnings about the file.
    pub(crate) warnings: Vec<Diagnostic>,
    /// The changes of units, axes or offsets that were applied when the clip was read.
    pub(crate) adjustment: Option<Adjustment>,
    /// Whether the keys of the clip differ from those in the file.
    pub(crate) is_changed: bool,
}

impl Clip {
    /// The clip with other keys. It still refers to its file, so that saving keeps the other contents.
    pub(crate) fn with_keys(&self, motion: Motion) -> Self {
        let source = self.source.as_ref().map(|source| {
            Arc::new(Source {
                is_changed: true,
                ..(**source).clone()
            })
        });
        Self {
            motion: Arc::new(motion),
            source,
        }
    }

    /// The clip without the other contents of its file, which do not fit it.
    pub(crate) fn without_document(self) -> Self {
        let source = self.source.map(|source| {
            Arc::new(Source {
                document: None,
                is_changed: true,
                ..(*source).clone()
            })
        });
        Self { source, ..self }
    }

    /// The length of each box, if the file contains boxes (.dat).
    pub(crate) fn box_length(&self) -> Option<f64> {
        self.source.as_ref().and_then(|source| source.box_length)
    }
}

impl Clip {
    /// The index of a track from its index or its name.
    pub(crate) fn track(&self, track: &Bound<'_, PyAny>) -> PyResult<usize> {
        let set = &self.motion.set;
        let tracks = set.track_count();
        if let Ok(name) = track.cast::<PyString>() {
            let name = name.to_cow()?;
            let found = (0..tracks).find(|&index| set.track_name(index) == *name);
            return found.ok_or_else(|| PyKeyError::new_err(format!("there is no track `{name}`")));
        }
        let index: isize = track.extract().map_err(|error| {
            expected(track.py(), error, || {
                "give a track as its index, from 0, or its name".to_owned()
            })
        })?;
        let from_end = if index < 0 { tracks as isize } else { 0 };
        usize::try_from(index + from_end)
            .ok()
            .filter(|&index| index < tracks)
            .ok_or_else(|| {
                PyIndexError::new_err(format!("there is no track {index}; there are {tracks}"))
            })
    }
}
