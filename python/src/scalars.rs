//! The scalars of clips at samples.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::{Layout, Quantity, ScalarQuantity};

use crate::clip::Clip;
use crate::engine::Engine;
use crate::errors::{input, of_engine};
use crate::names::unknown_name;
use crate::options::EvaluationKeywords;
use crate::run::interruptible;

/// Evaluates the scalars with these names, or all if there are no names.
pub(crate) fn evaluate<'py>(
    engine: &Engine,
    clip: &Bound<'py, Clip>,
    (quantity, names, layout): (ScalarQuantity, Option<Vec<String>>, Layout),
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = clip.py();
    let motion = clip.get().motion.clone();
    let count = motion.set.scalar_count();
    let chosen: Vec<usize> = match names {
        None => (0..count).collect(),
        Some(names) => {
            let known: Vec<&str> = (0..count)
                .filter_map(|index| motion.set.scalar(index).map(|scalar| scalar.name))
                .collect();
            let index = |name: &String| {
                motion.set.scalar_named(name).ok_or_else(|| {
                    let refusal = format!("names: the clip has no scalar `{name}`");
                    input(unknown_name(&refusal, name, &known))
                })
            };
            names.iter().map(index).collect::<PyResult<_>>()?
        }
    };
    let request = EvaluationKeywords::new(options)?;
    let (frames, samples) = request.resolved(&motion)?;
    let methods = request.methods(Quantity::Rotation);
    let held = engine.engine_for(samples * count.max(1))?;
    let of_clip = motion.clone();
    let found = interruptible(py, move || {
        methods
            .scalars(&held, &of_clip, &frames, quantity)
            .map_err(|error| of_engine(&error))
    })?;
    let number = |scalar: usize, sample: usize| {
        let origin = match quantity {
            ScalarQuantity::Value => motion.scalar(scalar).origin,
            _ => 0.0,
        };
        (f64::from(found[sample * count + scalar]) + origin) as f32
    };
    let (rows, numbers): (_, Vec<f32>) = match layout {
        Layout::TrackMajor => {
            let all = chosen
                .iter()
                .flat_map(|&scalar| (0..samples).map(move |sample| (scalar, sample)));
            (
                [chosen.len(), samples],
                all.map(|(scalar, sample)| number(scalar, sample)).collect(),
            )
        }
        Layout::FrameMajor => {
            let all =
                (0..samples).flat_map(|sample| chosen.iter().map(move |&scalar| (scalar, sample)));
            (
                [samples, chosen.len()],
                all.map(|(scalar, sample)| number(scalar, sample)).collect(),
            )
        }
    };
    Ok(PyArray1::from_vec(py, numbers).reshape(rows)?.into_any())
}
