//! A library in shards: cut once, by its list and sizes alone, evaluated shard by shard by any number
//! of processes on any machines, and merged into what one process would have written.
//!
//! `manifest.d` in the directory of results says what the shards are of (`plan.json`) and which are
//! done: each leaves its lines of the manifest in a file of its own, whole, after its results have
//! their names. Whoever evaluates a shard writes the same bytes, so that two who do so at once do no
//! harm, and nobody locks anything.

pub(crate) mod merge;
pub(crate) mod plan;
pub(crate) mod record;
pub(crate) mod run;
