//! Fuzz targets, for `cargo fuzz` (`fuzz_targets/`) and for `cargo test` (`cli/tests/fuzz.rs`).

mod targets;

/// Each target, by the name of what it fuzzes.
pub fn target(name: &str, data: &[u8]) {
    let target: targets::Target = match name {
        "dat" => targets::dat,
        "gltf" => targets::gltf::gltf,
        "bvh" => targets::motion::bvh,
        "fbx" => targets::motion::fbx,
        "tum" => targets::motion::tum,
        "euroc" => targets::motion::euroc,
        "kitti" => targets::motion::kitti,
        "mcap" => targets::motion::mcap,
        "npz" => targets::arrays::npz,
        "npy" => targets::arrays::npy,
        "outputs" => targets::outputs,
        "arguments" => targets::arguments,
        "frames" => targets::frames,
        "tracks" => targets::tracks,
        "spirv" => targets::spirv,
        "parquet" => targets::tables::parquet,
        "arrow" => targets::tables::arrow,
        "csv" => targets::tables::csv,
        "meshes" => targets::surfaces::meshes,
        "paths" => targets::surfaces::paths,
        "numbers" => targets::surfaces::numbers,
        _ => panic!("there is no target {name}"),
    };
    target(data);
}
