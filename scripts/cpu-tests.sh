#!/usr/bin/env bash
# Runs all tests of the CPU, on this machine or for another target for which cargo has a runner (`scripts/cpu-tests.sh
# TARGET`): recorded hashes at every vector width, bit identity between widths, accuracy against the f64 reference, the
# twins of the shaders, and files that are written and read again. No Vulkan device is needed or tested;
# `scripts/test.sh` tests these, on Linux.
set -euo pipefail
cd "$(dirname "$0")/.."
target=()
[ $# -eq 0 ] || target=(--target "$1")
# The bash of macOS treats an empty list as unset, so lists are written `${list[@]+"${list[@]}"}`. If CI is set, every
# test requires a Vulkan device.
unset CI

# Tests with Khronos' validator and tests that run the program are left out, because these programs do not run on the
# target.
engine=() parts=() files=(--skip validator)
case ${1:-} in
wasm32-*)
    # WebAssembly has no drivers, threads, caught panics or temporary folders. The twins of kernels need the feature
    # `vulkan`.
    engine=(--no-default-features)
    parts=(--skip threads:: --skip gpu::cache::)
    files+=(--skip beneath:: --skip guarded:: --skip output:: --skip path::tests::files_of_paths
        --skip fixtures --skip gltf:: --skip gltf_bake --skip gltf_gather --skip gltf_new --skip origins
        --skip reduce:: --skip round_trip)
    ;;
esac

echo "== recorded hashes"
cargo run --quiet --release --manifest-path tests/without_vulkan/Cargo.toml ${target[@]+"${target[@]}"} -- golden

echo "== the engine's parts, the twins of the shaders among them"
cargo test --quiet -p tumble --lib ${engine[@]+"${engine[@]}"} ${target[@]+"${target[@]}"} -- ${parts[@]+"${parts[@]}"}

echo "== the engine"
cargo test --quiet -p tumble --test all ${engine[@]+"${engine[@]}"} ${target[@]+"${target[@]}"} -- \
    accuracy:: bit_identity:: c2:: encoding:: extremes:: follow:: motion:: numbers:: outside:: poses:: \
    reduce:: stream:: textbook:: times:: transforms:: verify:: widths::

echo "== files"
cargo test --quiet -p tumble-formats --no-default-features --lib --test all ${target[@]+"${target[@]}"} -- "${files[@]}"
