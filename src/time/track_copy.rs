//! A copy of a track that repeats, and where it lies among the frames.

use std::ops::Range;

use crate::time::moment::Moment;

/// Consecutive samples that lie in one copy of a track.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrackCopy {
    pub(crate) samples: Range<usize>,
    pub(crate) position: CopyPosition,
}

/// Where a copy lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum CopyPosition {
    /// It is the track itself.
    Track,
    /// The track's first key, at `first` seconds, lies at the frame coordinate `at_first` in it.
    Frames {
        first: f64,
        at_first: f64,
        backwards: bool,
    },
    /// The track's time at the copy's only sample: copies that are too short, or too far out, to be laid
    /// out in frames.
    At(Moment),
}

impl TrackCopy {
    /// The track itself.
    pub(crate) fn of_track(samples: Range<usize>) -> Self {
        Self {
            samples,
            position: CopyPosition::Track,
        }
    }

    pub(crate) fn is_track(&self) -> bool {
        self.position == CopyPosition::Track
    }

    pub(crate) fn is_backwards(&self) -> bool {
        matches!(
            self.position,
            CopyPosition::Frames {
                backwards: true,
                ..
            }
        )
    }
}
