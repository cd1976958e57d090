//! Files: keyframes in (`.dat`), rotations out (NPY, CSV), one file per format.

mod blocks;
pub mod csv;
pub mod dat;
pub mod diagnostic;
mod lines;
pub mod npy;
mod number;
pub mod output;
pub mod poses;
mod source;
pub mod times;

pub use diagnostic::{Code, Diagnostic, Severity};
