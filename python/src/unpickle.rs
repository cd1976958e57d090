//! Results made again of their pickles: the classes that can be pickled.

use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::compare::{
    ArrayDifference, ChannelDifference, ClipDifference, JointDifference, PathErrors,
    PathStatistics, Spread,
};
use crate::errors::guarded;
use crate::events::{ClipEvent, PassedEvent};
use crate::reduce::Reduction;
use crate::route::{Route, Surface, Walk};
use crate::stream::Chunk;
use crate::values::{Value, broken};
use crate::verify::Verification;

type Maker = for<'py> fn(&Bound<'py, PyTuple>) -> PyResult<Bound<'py, PyAny>>;

fn made<'py, T: Value>(state: &Bound<'py, PyTuple>) -> PyResult<Bound<'py, PyAny>> {
    let value = guarded(|| T::of_state(state))?;
    Ok(Bound::new(state.py(), value)?.into_any())
}

/// The classes that can be unpickled, by name.
const MAKERS: [(&str, Maker); 15] = [
    ("ArrayDifference", made::<ArrayDifference>),
    ("ChannelDifference", made::<ChannelDifference>),
    ("Chunk", made::<Chunk>),
    ("ClipDifference", made::<ClipDifference>),
    ("ClipEvent", made::<ClipEvent>),
    ("JointDifference", made::<JointDifference>),
    ("PassedEvent", made::<PassedEvent>),
    ("PathErrors", made::<PathErrors>),
    ("PathStatistics", made::<PathStatistics>),
    ("Reduction", made::<Reduction>),
    ("Route", made::<Route>),
    ("Spread", made::<Spread>),
    ("Surface", made::<Surface>),
    ("Verification", made::<Verification>),
    ("Walk", made::<Walk>),
];

/// Restores the value of a pickle.
#[pyfunction]
pub(crate) fn value_of_state<'py>(
    name: &str,
    state: &Bound<'py, PyTuple>,
) -> PyResult<Bound<'py, PyAny>> {
    let maker = MAKERS.iter().find(|(known, _)| *known == name);
    maker.ok_or_else(broken)?.1(state)
}
