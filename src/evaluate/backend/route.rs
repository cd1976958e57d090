//! The route of a set to its rotations, chosen once for a call. Every route gives the same
//! bits; they differ in what they prepare and keep.

use std::fmt;

use crate::curve::options::Speed;
use crate::evaluate::backend::Backend;
use crate::from_keys::KeyCurve;
use crate::output::rotations::Layout;
use crate::prepare::request::SetRequest;
use crate::time::frames::Ticks;

/// The average number of keys of a track up to which batches serve a set whose tracks must not be
/// cut: with longer tracks, too few threads would have work.
const LONG_TRACK: usize = 16 * 1024;

/// Key intervals that are prepared for one sample that stands alone, and as many again for what it costs
/// to find them one by one: with fewer keys for each sample, preparing all takes no longer.
const KEYS_OF_A_SAMPLE: usize = 8;

/// The same where the velocities at the keys of a whole window of the track are solved for.
const KEYS_OF_A_SOLUTION: usize = 2048;

/// How a set becomes rotations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SetRoute {
    /// Every sample straight from the keys beside it.
    FromKeys(KeyCurve),
    /// In batches: a thread of the CPU prepares some intervals, evaluates them while their
    /// segments are in its cache, and forgets them.
    Batches {
        /// Whether a long track may be cut into several.
        cuts_tracks: bool,
    },
    /// On the CPU: only the key intervals that have a sample are prepared.
    SparseSamples,
    /// The segments of all tracks are prepared before the first is evaluated. A Vulkan device
    /// takes as many tracks at a time as it has memory for.
    Clips {
        /// Whether a track that exceeds that memory may be cut.
        cuts_tracks: bool,
    },
}

impl Backend {
    pub(crate) fn route(&self, request: &SetRequest<'_>, layout: Layout) -> SetRoute {
        let (set, timeline) = (request.set, request.timeline);
        let interpolation = request.interpolation;
        let in_rows = layout.of(timeline.len()) == Layout::TrackMajor;
        let in_order = matches!(timeline.ticks, Ticks::Frames { .. });
        let are_held = interpolation.wrap().are_held();
        let cuts_tracks = in_rows && in_order && are_held && interpolation.speed == Speed::AsKeyed;
        if timeline.is_empty() {
            return SetRoute::Clips { cuts_tracks };
        }
        let is_sparse = matches!(self, Self::Cpu(_)) && has_sparse_samples(request);
        let curve = match in_rows || is_sparse {
            true => KeyCurve::of_set(set, interpolation, timeline),
            false => None,
        };
        if is_sparse && curve.is_none() {
            return SetRoute::SparseSamples;
        }
        if !in_rows && !is_sparse {
            return SetRoute::Clips { cuts_tracks };
        }
        match (self, curve) {
            (Self::Cpu(_), Some(curve)) => SetRoute::FromKeys(curve),
            (Self::Cpu(_), None) => {
                let are_short = set.key_count() <= LONG_TRACK * set.track_count();
                match are_held && (are_short || cuts_tracks) {
                    true => SetRoute::Batches { cuts_tracks },
                    false => SetRoute::Clips { cuts_tracks },
                }
            }
            (Self::Vulkan(opened), Some(curve)) => {
                // Where samples are explicit times, the keys of a track are not cut.
                let window = opened.engine().window();
                match in_order || set.longest().max(timeline.len()) <= window {
                    true => SetRoute::FromKeys(curve),
                    false => SetRoute::Clips { cuts_tracks },
                }
            }
            (Self::Vulkan(_), None) => SetRoute::Clips { cuts_tracks },
        }
    }
}

impl SetRoute {
    /// Whether it is taken because there are few samples for many keys.
    pub(crate) fn is_sparse(self) -> bool {
        matches!(self, Self::FromKeys(_) | Self::SparseSamples)
    }

    /// Whether it gives rows, each with the samples of a track, whatever the layout of the result.
    pub(crate) fn is_of_rows(self) -> bool {
        !matches!(self, Self::Clips { .. })
    }
}

/// Whether there are so few samples for so many keys that only the intervals with a sample are worth
/// preparing, and each of these can be prepared without the others.
fn has_sparse_samples(request: &SetRequest<'_>) -> bool {
    let (tracks, interpolation) = (request.tracks.clone(), request.interpolation);
    let in_frames = matches!(request.timeline.ticks, Ticks::Frames { .. });
    let are_together = in_frames && interpolation.wrap().repeats();
    let each = match interpolation.method.is_solved() {
        true => KEYS_OF_A_SOLUTION,
        false => KEYS_OF_A_SAMPLE,
    };
    let samples = tracks.len().saturating_mul(request.timeline.len());
    interpolation.speed == Speed::AsKeyed
        && !are_together
        && samples.saturating_mul(each) <= request.set.keys_of(tracks)
}

impl fmt::Display for SetRoute {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FromKeys(KeyCurve::Arcs) => {
                f.write_str("fewer samples than keys: each sample straight from the two keys beside it")
            }
            Self::FromKeys(KeyCurve::TwoKeys) => f.write_str(
                "fewer samples than keys, two keys a track: each sample straight from its track's keys",
            ),
            Self::FromKeys(KeyCurve::Cubics(_)) => f.write_str(
                "fewer samples than keys, most of which turn little: each sample straight from the four keys around it; intervals that turn too far are prepared",
            ),
            Self::Batches { cuts_tracks } => {
                f.write_str("in batches: a thread prepares about a thousand keys, evaluates them while their segments are in its cache, and forgets them")?;
                match cuts_tracks {
                    true => f.write_str("; long tracks are shared among the threads"),
                    false => Ok(()),
                }
            }
            Self::SparseSamples => f.write_str(
                "far fewer samples than keys: the intervals that have a sample are prepared, and no others",
            ),
            Self::Clips { .. } => f.write_str(
                "as a clip: all segments are prepared and brought to the device, as many tracks at a time as it has memory for, then evaluated",
            ),
        }
    }
}
