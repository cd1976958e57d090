//! Results written to files: planned, hashed, written completely or not at all; and batches with a manifest.

pub(crate) mod digest;
pub(crate) mod entry;
pub(crate) mod manifest;
pub(crate) mod output_plan;
pub(crate) mod owner;
pub(crate) mod pipeline;
pub(crate) mod preview;
pub(crate) mod result_names;
pub(crate) mod room;
pub(crate) mod shards;
pub(crate) mod summary;
pub(crate) mod target;
