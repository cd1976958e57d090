//! Fuzz targets, for `cargo fuzz` (`fuzz_targets/`) and for `cargo test` (`cli/tests/fuzz.rs`).

mod targets;

use tumble_formats::FORMATS;

/// Runs the target with a name on some bytes.
pub fn target(name: &str, data: &[u8]) {
    let target: fn(&[u8]) -> u64 = match name {
        "formats" => formats,
        "outputs" => targets::outputs,
        "arguments" => targets::arguments,
        "frames" => targets::frames,
        "tracks" => targets::tracks,
        "spirv" => targets::spirv,
        "surfaces" => targets::surfaces::surfaces,
        "paths" => targets::surfaces::paths,
        "numbers" => targets::surfaces::numbers,
        // The root element distinguishes the two formats; each has a separate corpus.
        "mjcf" | "urdf" => targets::robots::robot,
        _ => panic!("there is no target {name}"),
    };
    target(data);
}

/// A file of the format that the first byte chooses.
fn formats(bytes: &[u8]) -> u64 {
    match bytes.split_first() {
        Some((&choice, file)) => {
            let format = FORMATS[usize::from(choice) % FORMATS.len()];
            targets::formats::format(format, file)
        }
        None => 0,
    }
}
