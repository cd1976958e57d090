//! What preparing needs, kept from call to call: to make it takes as long as to prepare a
//! hundred keys.

use std::sync::{Mutex, PoisonError};

use crate::clock::Timeline;
use crate::method::Interpolation;
use crate::prepare::{Preparation, Prepared};
use crate::tracks::TrackSet;

/// What one thread needs.
pub(super) struct Memory {
    interpolation: Interpolation,
    pub(super) prepared: Prepared,
    pub(super) preparation: Preparation,
}

/// What threads have given back.
#[derive(Default)]
pub(super) struct Memories(Mutex<Vec<Memory>>);

impl Memories {
    /// For the samples of one timeline.
    pub(super) fn take(
        &self,
        interpolation: &Interpolation,
        timeline: &Timeline,
        set: &TrackSet,
    ) -> Memory {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let suits = |memory: &Memory| memory.interpolation == *interpolation;
        let mut memory = kept.filter(suits).unwrap_or_else(|| Memory {
            interpolation: *interpolation,
            prepared: Prepared::new(interpolation),
            preparation: Preparation::new(interpolation),
        });
        memory.preparation.only_for(timeline, set);
        memory
    }

    /// Only after success: what failed may be half way.
    pub(super) fn give_back(&self, memory: Memory) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() < rayon::current_num_threads() {
            kept.push(memory);
        }
    }
}
