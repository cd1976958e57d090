//! TODO-DOC

pub(crate) mod check;
pub(crate) mod error;
pub(crate) mod key_data;
pub(crate) mod set;
pub(crate) mod signs;
pub(crate) mod track_keys;
pub(crate) mod vectors;
