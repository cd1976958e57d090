//! Every test of the program that may share its process with others.
//! `cargo test -p tumble-cli --test all plot::` runs those of one file.

// Tests may use what systems round differently (clippy.toml).
#![allow(clippy::disallowed_methods)]

// Written by `UPDATE_EXPECTED=1 cargo test -p tumble-cli --test all commands::`.
#[cfg(unix)]
mod attack;
mod batch;
mod circles;
mod cli;
mod cli_arguments;
mod cli_files;
mod cli_listings;
mod commands;
mod compare;
mod configurations;
mod dat_fixtures;
mod end_frame;
mod examples;
mod faults;
mod features;
mod follow;
#[cfg(unix)]
mod interface;
mod json;
mod lab;
mod meaning;
mod motion;
mod peers;
mod plot;
mod prove;
mod recipes;
mod reduce;
#[cfg(unix)]
mod remedies;
mod render;
mod reporting;
mod retarget;
mod robots;
mod route;
mod shards;
mod stubs;
mod trajectories;
mod travel;
mod tutorial;
mod validation;
mod view;
mod view_controls;
mod view_ghosts;
mod view_live;
mod view_skeletons;
// End of the list.

#[path = "../../tests/support/application.rs"]
mod application;
#[path = "support/browser.rs"]
mod browser;
#[path = "../../formats/tests/cases.rs"]
mod cases;
#[path = "../../tests/support/layer.rs"]
mod layer;
#[path = "support/program.rs"]
mod program;
#[path = "../../tests/support/mod.rs"]
mod support;
#[path = "support/tree.rs"]
mod tree;
