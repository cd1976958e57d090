//! Arguments that several commands share, parsed into what they mean.

pub(crate) mod device;
pub(crate) mod gather;
pub(crate) mod given;
pub(crate) mod input;
pub(crate) mod interpolation;
mod named_device;
pub(crate) mod path;
pub(crate) mod reading;
pub(crate) mod results;
pub(crate) mod time;
pub(crate) mod tolerance;
pub(crate) mod tracks;
pub(crate) mod what;
pub(crate) mod wildcard;
