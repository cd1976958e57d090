//! Prepared tracks on an engine's machine.

use std::sync::Arc;

use crate::machine::error::EvaluateError;
use crate::machine::plan::segment_bytes;
use crate::machine::{Machine, MachineClip};
use crate::memory::{OutOfMemoryError, refuse_more_than_there_is};
use crate::method::interpolation::Interpolation;
use crate::prepare::clip_data::{ClipData, PrepareRequest};
use crate::prepare::prepared::SEGMENTS;
use crate::tracks::set::TrackSet;

/// Prepares the requested tracks of a set on a machine, in the memory of `spare`, which is no longer needed.
pub(crate) fn prepare(
    machine: &Arc<dyn Machine>,
    set: &TrackSet,
    interpolation: Interpolation,
    mut to_prepare: PrepareRequest<'_>,
    mut spare: Option<Box<dyn MachineClip>>,
) -> Result<Box<dyn MachineClip>, EvaluateError> {
    let limits = machine.limits();
    to_prepare.group_bytes = limits.group_bytes;
    to_prepare.lists_arcs = limits.prepares_arcs(to_prepare.batch.keys(set));
    if let Some(spare) = &mut spare {
        to_prepare.spare = spare.take_segments();
    }
    let data = ClipData::new(set, interpolation, to_prepare)?;
    match spare {
        Some(mut clip) => {
            clip.replace(data)?;
            Ok(clip)
        }
        None => Arc::clone(machine).clip(data),
    }
}

/// Tracks that are prepared for any timeline.
pub(crate) struct Uploaded {
    clip: Box<dyn MachineClip>,
    /// The set, if its segments exceed the engine's memory limit; then nothing is prepared before the evaluation.
    pub(crate) unprepared: Option<TrackSet>,
}

impl Uploaded {
    /// Takes data that is prepared already.
    pub(crate) fn of_data(
        machine: &Arc<dyn Machine>,
        data: ClipData,
    ) -> Result<Self, EvaluateError> {
        Ok(Self {
            clip: Arc::clone(machine).clip(data)?,
            unprepared: None,
        })
    }

    /// Prepares a whole set; nothing if its segments exceed the engine's memory limit.
    pub(crate) fn whole(
        machine: &Arc<dyn Machine>,
        set: &TrackSet,
        interpolation: Interpolation,
    ) -> Result<Self, EvaluateError> {
        let needed = segment_bytes(set, &interpolation);
        let fits = machine.limits().memory.is_none_or(|limit| needed <= limit);
        let clip = match fits {
            true => {
                refuse_more_than_there_is::<u8>(needed, SEGMENTS)?;
                prepare(machine, set, interpolation, PrepareRequest::all(set), None)?
            }
            false => Arc::clone(machine).clip(ClipData::unprepared(set, interpolation)?)?,
        };
        Ok(Self {
            clip,
            unprepared: (!fits).then(|| set.clone()),
        })
    }

    pub(crate) fn data(&self) -> &ClipData {
        self.clip.data()
    }

    /// The prepared tracks; an error if the segments exceed the engine's memory limit.
    pub(crate) fn prepared(&self) -> Result<&dyn MachineClip, EvaluateError> {
        match &self.unprepared {
            None => Ok(&*self.clip),
            Some(set) => {
                let needed = segment_bytes(set, &self.data().interpolation);
                Err(OutOfMemoryError::new::<u8>(SEGMENTS, needed).into())
            }
        }
    }
}
