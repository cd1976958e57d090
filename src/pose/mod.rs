//! TODO-DOC

pub(crate) mod on_cpu;
pub(crate) mod poses;
pub(crate) mod skeleton;
pub(crate) mod transforms;
