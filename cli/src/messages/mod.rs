//! Messages, and the exit codes.

pub(crate) mod colours;
pub(crate) mod drawn;
pub(crate) mod exit;
pub(crate) mod listing;
pub(crate) mod names;
pub(crate) mod progress;
pub(crate) mod signals;
pub(crate) mod warnings;
pub(crate) mod words;
