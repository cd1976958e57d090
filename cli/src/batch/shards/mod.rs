//! A library in shards: cut once, by its list and sizes alone, evaluated shard by shard by any number
//! of processes on any machines, and merged into what one process would have written.
//!
//! `manifest.d` in the directory of results records the plan (`plan.json`) and which shards are done:
//! each writes its lines of the manifest to its own file, completely, after its results have
//! their names. Every process that evaluates a shard writes the same bytes, so that two that do so at once do no
//! harm, and no lock is needed.

pub(crate) mod merge;
pub(crate) mod plan;
pub(crate) mod record;
pub(crate) mod run;
