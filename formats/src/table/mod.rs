//! Tables of keys: Parquet, Arrow IPC and CSV are three forms of the same columns.
//!
//! A format reads the names of its columns, and the [`plan`] assigns a meaning to them. The format then reads the
//! columns of the plan ([`columns`]), and [`clips`] makes clips of them.

#[cfg(feature = "parquet")]
pub(crate) mod arrays;
pub(crate) mod clips;
#[cfg_attr(
    not(feature = "parquet"),
    expect(dead_code, reason = "CSV alone has no lists, stamps or f32")
)]
pub(crate) mod columns;
pub(crate) mod groups;
#[cfg(feature = "parquet")]
pub(crate) mod long;
pub(crate) mod plan;
#[cfg(feature = "parquet")]
pub(crate) mod rows;
#[cfg(feature = "parquet")]
pub(crate) mod scalars;
#[cfg(feature = "parquet")]
pub(crate) mod skeleton;
pub(crate) mod times;

#[cfg(feature = "parquet")]
use crate::diagnostic::{Code, Diagnostic};
#[cfg(feature = "parquet")]
use crate::guarded::guarded;

/// The result of `decode`, which calls decoders of other crates. Their assertions fail if `part` of a file is
/// damaged; this becomes an error. Values that they have modified are not used afterwards.
#[cfg(feature = "parquet")]
pub(crate) fn decoded<T>(
    name: &str,
    part: &str,
    decode: impl FnOnce() -> Result<T, Diagnostic>,
) -> Result<T, Diagnostic> {
    guarded(decode).unwrap_or_else(|_| {
        let message = format!("{part} cannot be decoded; the file is damaged, write it again");
        Err(Diagnostic::new(name, Code::TableDamaged, message))
    })
}
