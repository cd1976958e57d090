//! Whether the compiled kernels belong to the shaders, and which vectors the engine is compiled for.

mod hashes;

use std::path::Path;
use std::{env, fs};

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    // Vectors wider than the baseline's: see src/simd/dispatch.rs.
    println!("cargo::rustc-check-cfg=cfg(wide_vectors)");
    // WebAssembly that is to be as small as can be leaves out second ways to the same bits, which only are faster.
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
    // Without a list every file is new.
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
