#!/usr/bin/env bash
# Compiles every package with the oldest Rust that Cargo.toml promises. If it is missing, rustup installs it.
set -euo pipefail
cd "$(dirname "$0")/.."
oldest=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
rustup run "$oldest" rustc --version >/dev/null 2>&1 || rustup toolchain install "$oldest" --profile minimal
CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-target}/oldest rustup run "$oldest" \
    cargo check --workspace --all-targets --quiet
echo "every package compiles with Rust $oldest"
