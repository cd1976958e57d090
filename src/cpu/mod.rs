//! The CPU: the shaders' arithmetic in vector lanes, on all threads, with the bits of every Vulkan device.
//!
//! Evaluating a sample costs a few nanoseconds, less than fetching its segment from memory or writing it there. So
//! a thread prepares about a thousand keys, evaluates them while their segments are in its cache, and forgets them;
//! long results are written past the caches; and a run's samples, which share a segment, fill the lanes of a vector.
//!
//! # Types
//!
//! * [`CpuEngine`](engine::CpuEngine): a vector width, threads, and the scratch buffers that are kept between calls
//!   ([`ScratchPool`](scratch::ScratchPool)). Its ways to evaluate are its child modules.
//! * [`Row`](row::Row): the samples of one part of a track.
//! * [`VectorLoop`](evaluate::VectorLoop): a run of samples, a vector at a time, and [`Sink`](evaluate::Sink), where
//!   they are stored.
//! * [`Stage`](streaming::Stage): where rows are written: into the result, or through staging lines.
//!
//! # From a call to its bytes
//!
//! `evaluate` chooses one of four:
//!
//! | in [`engine`] | for | what is prepared |
//! |---|---|---|
//! | `evaluate_batches` | sets | batch by batch, evaluated at once and forgotten |
//! | `clip` | clips, and frame by frame | everything, before |
//! | `sparse_samples` | far fewer samples than keys | the intervals with a sample |
//! | `from_keys` | fewer samples than keys, arcs and cubics of small angles | nothing; intervals whose angles turn out too large are prepared alone |
//!
//! All but the last end in `CpuEngine::part`, which evaluates a [`Row`](row::Row): the intervals of a part come in
//! blocks with the samples that each has, and every run is evaluated where it is met ([`evaluate`]). Samples at
//! listed times, or in copies of a track, are listed as runs first. The loops are compiled for each vector width;
//! lanes lie along the samples of a run.
//!
//! # Where memory lies
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
//! A result of 32 MiB or more is written by streaming stores, on processors that gain by them. They need whole cache
//! lines, so what begins or ends within a line waits in a staging line. Shorter results are written where they belong.

pub(crate) mod engine;
pub(crate) mod evaluate;
pub(crate) mod row;
pub(crate) mod scratch;
pub(crate) mod streaming;
