#!/usr/bin/env bash
# The bill of materials of each published part, as CycloneDX JSON, in a folder [target/sbom]: every crate with its version,
# licence and checksum, by cargo-cyclonedx, which is installed into target/tools if it is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:-target/sbom}
version=0.5.9
tools=${CARGO_TARGET_DIR:-target}/tools
if ! "$tools/bin/cargo-cyclonedx" cyclonedx --version 2>/dev/null | grep -qF "$version"; then
    cargo install --quiet --locked --root "$tools" --version "$version" cargo-cyclonedx
fi
mkdir -p "$folder"
for part in cli capi python npm; do
    "$tools/bin/cargo-cyclonedx" cyclonedx --format json --override-filename sbom --manifest-path "$part/Cargo.toml"
    # One file for each crate of the workspace that the part has; its own is what was asked for.
    mv "$part/sbom.json" "$folder/tumble-$part.cdx.json"
    git clean -qfx -- '*/sbom.json' sbom.json
done
ls "$folder"
