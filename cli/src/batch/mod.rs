//! Results on their way to files: planned, hashed, written whole or not at all; and many of
//! them, with a manifest.

pub(crate) mod digest;
pub(crate) mod folder;
pub(crate) mod manifest;
pub(crate) mod output;
pub(crate) mod place;
pub(crate) mod room;
pub(crate) mod run;
pub(crate) mod shards;
pub(crate) mod stream;
