//! Prepared tracks on an engine's machine.

use std::sync::Arc;

use crate::from_keys::kept::KeptKeys;
use crate::machine::error::EvaluateError;
use crate::machine::plan::segment_bytes;
use crate::machine::{Machine, MachineClip};
use crate::memory::{OutOfMemoryError, refuse_more_than_there_is};
use crate::method::interpolation::Interpolation;
use crate::prepare::clip_data::{ClipData, PrepareRequest};
use crate::prepare::error::SetError;
use crate::prepare::prepared::{Prepared, SEGMENTS};
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

/// The tracks of a clip.
pub(crate) enum Uploaded {
    /// Prepared for any timeline.
    Prepared(Box<dyn MachineClip>),
    /// Keys from which samples are computed. They take much less memory than segments; many segments would have to be
    /// loaded from memory as well.
    Keys(Arc<KeptKeys>),
    /// A set that every evaluation prepares anew, because its segments exceed the engine's memory limit.
    Unprepared(Box<UnpreparedSet>),
}

/// A set without segments.
pub(crate) struct UnpreparedSet {
    set: TrackSet,
    /// The parts of a clip that are known without its segments.
    data: ClipData,
}

impl Uploaded {
    /// Takes data that is prepared already.
    pub(crate) fn of_data(
        machine: &Arc<dyn Machine>,
        data: ClipData,
    ) -> Result<Self, EvaluateError> {
        Ok(Self::Prepared(Arc::clone(machine).clip(data)?))
    }

    /// Prepares a whole set; nothing if its segments exceed the engine's memory limit.
    pub(crate) fn whole(
        machine: &Arc<dyn Machine>,
        set: &TrackSet,
        interpolation: Interpolation,
    ) -> Result<Self, EvaluateError> {
        let needed = segment_bytes(set, &interpolation);
        let limits = machine.limits();
        let budget = limits.memory.unwrap_or(usize::MAX);
        if !cfg!(smallest)
            && let Some(kept) = limits.kept_segments
            && needed > kept.min(budget)
        {
            // If most intervals need a segment, keep the segments of all.
            let bytes = if needed > budget { budget } else { needed / 2 };
            if let Some(keys) = KeptKeys::new(set, interpolation, bytes)? {
                return Ok(Self::Keys(Arc::new(keys)));
            }
        }
        if needed > budget {
            return Self::of_set(set.clone(), interpolation);
        }
        refuse_more_than_there_is::<u8>(needed, SEGMENTS)?;
        let to_prepare = PrepareRequest {
            packs: limits.packs_segments(),
            ..PrepareRequest::all(set)
        };
        let clip = prepare(machine, set, interpolation, to_prepare, None)?;
        Ok(Self::Prepared(clip))
    }

    /// A set that every evaluation prepares again; tracks that cannot be interpolated are refused.
    pub(crate) fn of_set(
        set: TrackSet,
        interpolation: Interpolation,
    ) -> Result<Self, EvaluateError> {
        let data = ClipData::unprepared(&set, interpolation).map_err(SetError::from)?;
        Ok(Self::Unprepared(Box::new(UnpreparedSet { set, data })))
    }

    /// The segments, or the data that is known without them.
    pub(crate) fn data(&self) -> &ClipData {
        match self {
            Self::Prepared(clip) => clip.data(),
            Self::Keys(keys) => &keys.data,
            Self::Unprepared(unprepared) => &unprepared.data,
        }
    }

    /// The set, if nothing is prepared for evaluations of many samples.
    pub(crate) fn unprepared(&self) -> Option<&TrackSet> {
        match self {
            Self::Prepared(_) => None,
            Self::Keys(keys) => Some(&keys.set),
            Self::Unprepared(unprepared) => Some(&unprepared.set),
        }
    }

    /// The prepared tracks; an error if the segments exceed the engine's memory limit.
    pub(crate) fn prepared(&self) -> Result<&dyn MachineClip, EvaluateError> {
        match self {
            Self::Prepared(clip) => Ok(&**clip),
            Self::Keys(keys) => Err(exceeds(&keys.set, &keys.data)),
            Self::Unprepared(unprepared) => Err(exceeds(&unprepared.set, &unprepared.data)),
        }
    }

    /// The source of single samples; an error if the segments exceed the engine's memory limit, and samples
    /// cannot be computed from keys within it.
    pub(crate) fn source(&self) -> Result<ClipSource, EvaluateError> {
        Ok(match self {
            Self::Keys(keys) => ClipSource::Keys(Arc::clone(keys)),
            _ => ClipSource::Segments(Arc::clone(self.prepared()?.data())),
        })
    }

    /// Bytes that the tracks take on the host.
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Prepared(clip) => clip.data().groups.iter().map(Prepared::bytes).sum(),
            Self::Keys(keys) => keys.bytes(),
            Self::Unprepared(unprepared) => unprepared.set.rotation_bytes(),
        }
    }

    /// The form in which the tracks are kept, in words that begin a description of how they are evaluated; nothing for
    /// segments.
    pub(crate) fn kept_form(&self) -> &'static str {
        match self {
            Self::Keys(_) => "from the clip's keys: ",
            _ => "",
        }
    }
}

fn exceeds(set: &TrackSet, data: &ClipData) -> EvaluateError {
    let needed = segment_bytes(set, &data.interpolation);
    OutOfMemoryError::new::<u8>(SEGMENTS, needed).into()
}

/// The source of single samples of a clip.
pub(crate) enum ClipSource {
    Segments(Arc<ClipData>),
    Keys(Arc<KeptKeys>),
}
