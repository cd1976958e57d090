#!/usr/bin/env bash
# The program `tumble` of this machine's system, stripped, with its licences, as one archive in target/program,
# and the archive's SHA-256 beside it.
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
# The program starts and prints its version.
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
