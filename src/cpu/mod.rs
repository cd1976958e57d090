//! The CPU: the shaders' arithmetic in vector lanes, on all threads, with the bits of every Vulkan device.
//!
//! Evaluating a sample takes a few nanoseconds, less than loading its segment from memory or storing the sample there.
//! Therefore a thread prepares about a thousand keys, evaluates them while their segments are in its cache, and drops
//! them. Long results bypass the caches. The samples of a run, which share a segment, fill the lanes of a vector.
//!
//! # Types
//!
//! * [`CpuEngine`](engine::CpuEngine): a vector width, threads, and the scratch buffers that are kept between calls
//!   ([`ScratchPool`](scratch::ScratchPool)). Its routes are its child modules.
//! * [`Row`](row::Row): the samples of one part of a track.
//! * [`VectorLoop`](evaluate::VectorLoop): a run of samples, a vector at a time, and [`Sink`](evaluate::Sink), the
//!   destination of their stores.
//! * [`Stage`](streaming::Stage): the destination of rows: the result directly, or staging lines.
//!
//! # Steps
//!
//! The engine is a [`Machine`](crate::machine::Machine) (`engine/machine.rs`), which chooses one of four functions:
//!
//! | in [`engine`] | for | what is prepared |
//! |---|---|---|
//! | `evaluate_batches` | sets | each batch, which is evaluated at once and then dropped |
//! | `clip` | clips, and frame-major results | everything, before the evaluation |
//! | `sparse_samples` | far fewer samples than keys | the intervals with a sample |
//! | `from_keys` | fewer than eight samples for a key, arcs and cubics of small angles | nothing, except for intervals whose angles are found to be too large |
//!
//! All but the last use `CpuEngine::part`, which evaluates a [`Row`](row::Row): the intervals of a part are processed
//! in blocks, each with its samples, and every run is evaluated when it is found ([`evaluate`]). Samples at listed
//! times, or in copies of a track, are first listed as runs. [`ShortRuns`](short_runs::ShortRuns) evaluates rows of clips
//! with few samples between keys. The loops are compiled for each vector width; the lanes
//! are samples of a run.
//!
//! # Memory
//!
//! ```text
//! thread's cache                        result
//! ┌──────────┬────────────┐  frames    ┌──────────────┬──────────────┬────
//! │ segments │ staging    │ ─────────► │ whole lines, │ whole lines  │ …
//! │ of a     │ lines      │            │ past caches  │              │
//! │ batch    │ (32 KiB)   │            └──────────────┴──────────────┴────
//! └──────────┴────────────┘
//! ```
//!
//! A result of 32 MiB or more is written by streaming stores, on processors where they are faster. They need whole
//! cache lines, so samples of incomplete lines wait in a staging line. Shorter results are written directly.

pub(crate) mod engine;
pub(crate) mod evaluate;
pub(crate) mod row;
pub(crate) mod scratch;
pub(crate) mod segment_list;
pub(crate) mod short_runs;
pub(crate) mod streaming;
