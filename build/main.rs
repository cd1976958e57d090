//! Checks that the compiled kernels belong to the shaders, and chooses the vectors for which the engine is compiled.

mod hashes;

use std::path::Path;
use std::{env, fs};

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    // Vectors wider than the baseline's: see src/simd/dispatch.rs.
    println!("cargo::rustc-check-cfg=cfg(wide_vectors)");
    // A WebAssembly build for the smallest size leaves out code that is only faster and gives the same bits as other
    // code.
    println!("cargo::rustc-check-cfg=cfg(smallest)");
    let level = env::var("OPT_LEVEL").unwrap_or_default();
    let target = env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
    if level == "z" && target == "wasm32" {
        println!("cargo::rustc-cfg=smallest");
    }
    let optimises = !matches!(&*level, "" | "0");
    if optimises && target == "x86_64" {
        println!("cargo::rustc-cfg=wide_vectors");
    }
    let now = hashes::of_folder(Path::new("."), "shaders")
        .unwrap_or_else(|error| panic!("shaders: {error}"));
    // If there is no list, every file counts as changed.
    let list = fs::read_to_string(hashes::LIST).unwrap_or_default();
    let changed = hashes::changed(&list, &now);
    if !changed.is_empty() {
        println!(
            "cargo::error=not as it was when the kernels were compiled: {}; run \
             `cargo run -p tumble-shaders`",
            changed.join(", ")
        );
    }
}
