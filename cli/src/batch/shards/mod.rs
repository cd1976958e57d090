//! A library in shards. The library is divided once, according to the list and the sizes of its files. Any number of
//! processes on any machines evaluate the shards. The results are then merged into those that one process would have
//! written.
//!
//! `manifest.d` in the directory of results records the plan (`plan.json`) and which shards are done: each shard writes
//! its lines of the manifest to a separate file, all at once, after its results have their names. Every process that
//! evaluates a shard writes the same bytes. So two processes may evaluate one shard at the same time, and no lock is
//! needed.

pub(crate) mod merge;
pub(crate) mod plan;
pub(crate) mod record;
pub(crate) mod run;
