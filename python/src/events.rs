//! Events of a crowd: named moments of its clips, and when its instances pass them.

use pyo3::prelude::*;

use crate::values::{Pickled, pickled, value};

/// A moment of a clip of a crowd, such as a step or the throw of a ball: for `Crowd(events=)`.
///
/// `ClipEvent(clip, time, name="")`
///
/// `clip`: the index of the clip. `time`: seconds from the clip's first key, which the crowd rounds to ticks. Several
/// events may have one name.
///
/// >>> import tumble
/// >>> tumble.ClipEvent(0, 0.5, "left foot down")
/// ClipEvent(0, 0.5, 'left foot down')
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ClipEvent {
    /// The index of the clip in the crowd.
    pub(crate) clip: usize,
    /// The time in seconds from the clip's first key.
    pub(crate) time: f64,
    /// The name.
    pub(crate) name: String,
}

value!(ClipEvent { clip, time, name });

#[pymethods]
impl ClipEvent {
    #[new]
    #[pyo3(signature = (clip, time, name=String::new()), text_signature = "(clip, time, name='')")]
    fn new(clip: usize, time: f64, name: String) -> Self {
        Self { clip, time, name }
    }

    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let Self { clip, time, name } = self;
        let name = name.into_pyobject(py)?.repr()?;
        Ok(format!("ClipEvent({clip}, {time:?}, {name})"))
    }
}

/// An event that a layer of an instance passed: of `Crowd.passed_events`.
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PassedEvent {
    /// The clock's time in ticks at which the layer reached the event.
    clock: u64,
    /// The instance.
    instance: usize,
    /// The layer.
    layer: usize,
    /// The event's index in `Crowd.events`.
    event: usize,
    /// The weight of the layer now, from 0 to 1.
    weight: f32,
}

value!(PassedEvent {
    clock,
    instance,
    layer,
    event,
    weight,
});

impl From<tumble::crowd::PassedEvent> for PassedEvent {
    fn from(passed: tumble::crowd::PassedEvent) -> Self {
        Self {
            clock: passed.clock,
            instance: passed.instance,
            layer: passed.layer,
            event: passed.event,
            weight: passed.weight,
        }
    }
}

#[pymethods]
impl PassedEvent {
    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        let Self {
            clock,
            instance,
            layer,
            event,
            weight,
        } = self;
        format!(
            "PassedEvent(clock {clock}, instance {instance}, layer {layer}, event {event}, weight {weight:?})"
        )
    }
}
