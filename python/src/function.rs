//! `tumble.evaluate`: arrays of keys to an array of rotations, in one call.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::Encoding;

use crate::arrays::Order;
use crate::build::{ClipKeys, KeysLayout};
use crate::engine::{default_engine, layout_named};
use crate::errors::guarded;
use crate::evaluate::OutputForm;
use crate::options::{EvaluationKeywords, request_arrays};
use crate::output::quaternions_of;
use crate::run::work;

/// Interpolates keys: `Clip(times, keys, order=order)`, evaluated by a shared engine.
///
/// `times` and `keys` are as those of `Clip`; `order` is that of the keys and of the result. Keys
/// (keys, 4) of one track give (frames, 4), (tracks, keys, 4) give (tracks, frames, 4). `fps`, `at`
/// and the other keywords are as those of `Engine.evaluate`.
///
/// >>> import numpy as np, tumble
/// >>> half = np.sqrt(0.5)
/// >>> tumble.evaluate([0.0, 2.0], [[1, 0, 0, 0], [0, 0, 0, 1]], at=[0.0, 1.0], order="wxyz",
/// ...                 method="slerp").round(4)
/// array([[1.    , 0.    , 0.    , 0.    ],
///        [0.7071, 0.    , 0.    , 0.7071]], dtype=float32)
#[pyfunction]
#[pyo3(signature = (times, keys, *, out=None, order="xyzw", layout="track", as_rotation=false, dtype=None, device_array=false, **options), text_signature = "(times, keys, *, fps=None, at=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, out=None, order='xyzw', layout='track', as_rotation=False, dtype='float32', device_array=False)")]
#[allow(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn evaluate<'py>(
    times: &Bound<'py, PyAny>,
    keys: &Bound<'py, PyAny>,
    out: Option<&Bound<'py, PyAny>>,
    order: &str,
    layout: &str,
    as_rotation: bool,
    dtype: Option<&Bound<'py, PyAny>>,
    device_array: bool,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    guarded(|| {
        let py = times.py();
        let request = EvaluationKeywords::new(options)?;
        let order = Order::named(order)?;
        let arrays = ClipKeys::new(times, keys, order, KeysLayout::OfClip)?;
        let is_one_track = arrays.is_one;
        let motion = work(py, arrays.key_count(), move || arrays.clip(None))?;
        let result = OutputForm {
            encoding: dtype.map_or(Ok(Encoding::F32), quaternions_of)?,
            // SciPy's rotations are always x y z w, so `order` does not apply.
            order: if as_rotation { Order::Xyzw } else { order },
            layout: layout_named(layout)?,
            as_rotation,
            on_card: device_array,
            is_one_track,
            ..OutputForm::default()
        };
        let engine = |rotations| default_engine(py)?.get().engine_for(rotations);
        let arrays = request_arrays(options)?;
        let inputs: Vec<_> = [times, keys].into_iter().chain(&arrays).collect();
        result.of(py, engine, &motion.into(), &request, out, &inputs)
    })
}
