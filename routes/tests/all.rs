//! Every test of routes. `cargo test -p tumble-routes --test all numbers::` runs those of one file.

mod numbers;
#[path = "support/shapes.rs"]
mod shapes;
