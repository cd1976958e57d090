#!/usr/bin/env bash
# Checks format, lints and documentation of every package and every target; a warning is an error. Parts whose component
# of rustup is not installed are left out. scripts/test.sh runs this first, except in CI.
set -euo pipefail
cd "$(dirname "$0")/.."

# The oldest Rust that Cargo.toml promises, if it is installed and is not the one in use.
oldest=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
if ! rustc --version | grep -q "^rustc $oldest\b" &&
    command -v rustup >/dev/null && rustup run "$oldest" rustc --version >/dev/null 2>&1; then
    ./scripts/oldest.sh
fi

# The rules for dependencies (deny.toml), if cargo-deny is installed.
if cargo deny --version >/dev/null 2>&1; then
    cargo deny --log-level error check bans licenses sources
else
    echo "licences, sources and duplicates of dependencies are not checked: cargo-deny is not installed" >&2
fi

if cargo fmt --version >/dev/null 2>&1; then cargo fmt --check; fi
if cargo clippy --version >/dev/null 2>&1; then
    cargo clippy --workspace --all-targets --quiet -- -D warnings
    # No other call compiles the tests that run on demand.
    cargo clippy --workspace --test load --quiet -- -D warnings
fi
# The documentation for users, whose links are checked; then the documentation with private items.
export RUSTDOCFLAGS="-D warnings"
rm -rf target/doc
cargo doc --workspace --no-deps --quiet
python3 scripts/doc-links.py target/doc
cargo doc --workspace --no-deps --document-private-items --quiet

# The engine without Vulkan, as an application builds it that uses only the CPU.
CARGO_TARGET_DIR=target/without_vulkan cargo run --quiet --manifest-path tests/without_vulkan/Cargo.toml

# Checks that the packages to publish can be packed: versions, licences, files. They are not built again, because a test
# (tests/tidy.rs) checks that each package has all files that its code includes.
cargo package --quiet --no-verify --allow-dirty --target-dir target/packages \
    -p tumble -p tumble-exact -p tumble-formats -p tumble-routes -p tumble-verify -p tumble-cli

# The guide as a book, whose links are checked.
./scripts/book.sh
