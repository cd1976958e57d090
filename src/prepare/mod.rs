//! Preparation of tracks: their keys are converted once per clip to segments, the coefficients that the kernels
//! evaluate. They do not depend on the frame rate or the device, so the CPU and every Vulkan device evaluate the same
//! segments.
//!
//! # Principle
//!
//! Tracks of a crowd have few keys, and a vector has up to 16 lanes. Therefore blocks are filled with intervals of
//! several tracks, and the rest of a block waits for the next one. Batches are small: on the CPU the segments of a
//! batch are evaluated while they are in a thread's cache, and then dropped. Arcs are computed in f32 with the
//! operations of the arc kernel's twin, curves as described in [`crate::fit`].
//!
//! # Types
//!
//! | type | what it is |
//! |---|---|
//! | [`preparation::Batch`] | the intervals that are prepared together: whole tracks, or some of a long one |
//! | [`preparation::Preparation`] | applies an interpolation to a batch, by one of three strategies |
//! | [`arcs::ArcPreparation`] | the strategy for slerp: up to 64 arcs at once |
//! | [`smooth::SmoothPreparation`] | the strategy for all other curves: blocks of 128 intervals |
//! | [`fast::FastPreparation`] | its fast way, in f32 straight from four keys |
//! | [`fitting::Fitting`] | its exact way: queues of curves that wait for a full block, and the cutter |
//! | [`constant_speed::PendingInterval`] | a curve at constant speed, until all curves of its track are known |
//! | [`packed::PackedSegments`] | the segments of a clip that is kept on the CPU, without the coefficients that are 0 |
//! | [`prepared::Prepared`] | the result of preparing a batch |
//! | [`clip_data::ClipData`] | all that is prepared of a clip, and which parts a track has |
//!
//! # Steps
//!
//! ```text
//! TrackSet ─► Batch ─► Preparation ─┬─ steps ──────────────────────────────► constants
//!                                   ├─ arcs: block of 64 ──────────────────► segments
//!                                   └─ smooth: block of 128 ─┬─ fast ──────► segments
//!                                                            └─ exact ───┬─► segments
//!                                                                        └─► exact (f64)
//! ```
//!
//! Each interval immediately has a span, in order of time, and an empty segment; the block that is fitted later fills
//! the segment. The span of a divided curve is replaced by several spans at the end.
//!
//! # Memory
//!
//! [`prepared::Prepared`] is lists and indices into them: a part is a range of spans, and a span (three lists of one
//! length, which are searched in vectors) has the source of its value.
//!
//! ```text
//! parts      track 0           track 1        track 2, first 4096 intervals …
//! starts     0.0   0.5   1.0   0.0   0.7  …   seconds, f64
//! sources    seg 0 seg 1 exact seg 2 con 5…   index of a segment, a constant or an exact curve
//! keys       0     1     -     3     4    …   the constant to store at exactly the start
//! segments   32 bytes per arc, 176 per polynomial; packed 112, 144 or 176
//! constants  16 bytes: keys, and values held at ends
//! exact      curves that no polynomial fits, and those outside the keys: the host evaluates them in f64
//! ```

pub(crate) mod arcs;
pub(crate) mod clip_data;
pub(crate) mod constant_speed;
pub(crate) mod error;
pub(crate) mod fast;
pub(crate) mod fitting;
pub(crate) mod packed;
pub(crate) mod preparation;
pub(crate) mod prepared;
pub(crate) mod smooth;
pub(crate) mod vectors;
