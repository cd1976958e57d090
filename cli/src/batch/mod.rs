//! Results written to files: planned, hashed, written completely or not at all; and batches with a manifest.

pub(crate) mod destination;
pub(crate) mod digest;
pub(crate) mod folder;
pub(crate) mod manifest;
pub(crate) mod output;
pub(crate) mod room;
pub(crate) mod run;
pub(crate) mod shards;
pub(crate) mod stream;
