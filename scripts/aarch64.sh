#!/usr/bin/env bash
# Compares the recorded hashes with results on aarch64 (NEON), by qemu. It is the part of scripts/platforms.sh that is
# short enough for CI. `--fetch` only installs Rust's standard library for aarch64 (qemu must be there already). The
# program is linked statically, with the linker that comes with Rust, so no other compiler is needed.
set -euo pipefail
cd "$(dirname "$0")/.."
target=aarch64-unknown-linux-musl

# If something is missing, the hashes are not compared; in CI this is a failure.
missing() {
    echo "no results of aarch64 were compared: $1" >&2
    [ -z "${CI:-}" ] || exit 1
    exit 0
}

if [ "$(uname -m)" = aarch64 ]; then
    echo "this processor is an aarch64: \`cargo test\` compares its results"
    exit 0
fi
command -v rustup >/dev/null || missing "rustup, which has Rust's standard library for $target, is not installed"
rustup target list --installed | grep -qx $target ||
    rustup target add $target ||
    missing "rustup could not install $target"
[ "${1:-}" != --fetch ] || exit 0
qemu=$(command -v qemu-aarch64-static || command -v qemu-aarch64) ||
    missing "qemu-aarch64 (Debian: qemu-user-static) is not installed"

# Few optimisations: with more, compiling would take longer than computing the hashes.
export CARGO_INCREMENTAL=0 CARGO_PROFILE_RELEASE_OPT_LEVEL=1 CARGO_PROFILE_RELEASE_CODEGEN_UNITS=4
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER=rust-lld
export CARGO_TARGET_DIR=$PWD/target/aarch64
# The same versions of crates as in the workspace.
cp Cargo.lock tests/without_vulkan/Cargo.lock
cargo build --quiet --release --manifest-path tests/without_vulkan/Cargo.toml --target $target
"$qemu" "$CARGO_TARGET_DIR/$target/release/without-vulkan" golden
