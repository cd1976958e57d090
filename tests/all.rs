//! Every test that may share its process with others: a program for each file would link
//! the library, and compile what it makes of generic functions, as often as there are files.
//! `cargo test --test all motion::` runs those of one file.

mod accuracy;
mod batch;
mod bit_identity;
mod cli;
mod cli_arguments;
mod configurations;
mod dat_fixtures;
mod encoding;
mod external_vectors;
mod faults;
mod golden;
mod motion;
mod original;
mod outside;
mod peers;
mod plot;
mod poses;
mod render;
mod speed;
mod spirv;
mod stream;
mod textbook;
mod tidy;
mod transforms;
mod validation;
mod view;
mod vulkan;

#[path = "support/application.rs"]
mod application;
#[path = "support/browser.rs"]
mod browser;
#[path = "support/program.rs"]
mod program;
mod support;
