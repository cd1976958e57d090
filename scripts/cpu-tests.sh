#!/usr/bin/env bash
# What is promised of the CPU, on this machine or for another target that cargo has a runner for
# (`scripts/cpu-tests.sh TARGET`): recorded hashes at every vector width, bit identity between widths, accuracy
# against the f64 reference, the twins of the shaders, and files that are written and read again. No Vulkan
# device is asked for, and none is compared: `scripts/test.sh` does that, on Linux.
set -euo pipefail
cd "$(dirname "$0")/.."
target=()
[ $# -eq 0 ] || target=(--target "$1")
# Where CI is set every test demands a Vulkan device.
unset CI

echo "== recorded hashes"
cargo run --quiet --release --manifest-path tests/without_vulkan/Cargo.toml "${target[@]}" -- golden

echo "== the engine's parts, the twins of the shaders among them"
cargo test --quiet -p tumble --lib "${target[@]}"

echo "== the engine"
cargo test --quiet -p tumble --test all "${target[@]}" -- \
    accuracy:: bit_identity:: c2:: encoding:: extremes:: follow:: motion:: numbers:: outside:: poses:: \
    reduce:: stream:: textbook:: times:: transforms:: verify:: widths::

# Khronos' validator and what runs the program are left out: they are for the machine itself.
echo "== files"
cargo test --quiet -p tumble-formats --no-default-features --lib --test all "${target[@]}" -- \
    --skip validator
