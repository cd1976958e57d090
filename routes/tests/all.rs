//! Every test of routes. `cargo test -p tumble-routes --test all numbers::` runs those of one file.

// Tests may use what systems round differently (clippy.toml).
#![allow(clippy::disallowed_methods)]

mod faces;
mod grounds;
mod inputs;
mod nets;
mod numbers;
mod properties;
#[path = "support/shapes.rs"]
mod shapes;
mod walking;
