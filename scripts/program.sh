#!/usr/bin/env bash
# Makes an archive in target/program with the program `tumble` for this machine's system, stripped, and its licences,
# and a file with the SHA-256 of the archive.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
host=$(rustc -vV | sed -n 's/^host: //p')
name=tumble-$version-$host
cargo build --release -p tumble-cli --bin tumble
case $host in
*windows*) program=tumble.exe ;;
*) program=tumble ;;
esac
# Check that the program starts and prints its version.
"$target/release/$program" --version | grep -qF "$version"
rm -rf "target/program/$name"
mkdir -p "target/program/$name"
cp "$target/release/$program" README.md CHANGELOG.md LICENSE-APACHE LICENSE-MIT "target/program/$name"
cd target/program
tar -czf "$name.tar.gz" "$name"
rm -rf "$name"
if command -v sha256sum >/dev/null; then
    sha256sum "$name.tar.gz" >"$name.tar.gz.sha256"
else
    shasum -a 256 "$name.tar.gz" >"$name.tar.gz.sha256"
fi
cat "$name.tar.gz.sha256"
