//! Tables of keys: Parquet, Arrow IPC and CSV are three ways to write the same columns.
//!
//! A format reads the names of its columns; the [`plan`] says which of them are what; the
//! format then reads those into [columns], and [clips] makes clips of them.

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
pub(crate) mod times;
