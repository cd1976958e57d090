#!/usr/bin/env bash
# Checks the package for wgpu by its lints, and by its example on lavapipe, which compares every bit. Not part of
# scripts/test.sh, because wgpu takes minutes to compile.
#
#   scripts/wgpu.sh                 the package
#   scripts/wgpu.sh bevy FILE.glb   also the example for Bevy, which writes target/bevy.png; it needs Rust 1.97
set -euo pipefail
cd "$(dirname "$0")/.."
./scripts/lavapipe.sh
export CARGO_TARGET_DIR=$PWD/target/wgpu
cargo clippy --quiet --manifest-path wgpu/Cargo.toml --all-targets -- -D warnings
cargo test --quiet --manifest-path wgpu/Cargo.toml --doc
cargo run --quiet --manifest-path wgpu/Cargo.toml --example crowd
if [ "${1:-}" = bevy ]; then
    rm -f target/bevy.png
    cargo run --quiet --manifest-path examples/bevy/Cargo.toml -- "$2" 1000 target/bevy.png
fi
