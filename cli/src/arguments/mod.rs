//! Options that several commands share, parsed into validated values.

pub(crate) mod device;
pub(crate) mod global;
pub(crate) mod input;
pub(crate) mod interpolation;
pub(crate) mod options;
pub(crate) mod output;
pub(crate) mod path;
pub(crate) mod reading;
pub(crate) mod results;
pub(crate) mod robot;
pub(crate) mod root_motion;
pub(crate) mod time;
pub(crate) mod tolerance;
pub(crate) mod tracks;
pub(crate) mod wildcard;
