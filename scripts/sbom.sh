#!/usr/bin/env bash
# Writes the bill of materials of each published part as CycloneDX JSON into a folder (target/sbom by default): every
# crate with its version, licence and checksum. If cargo-cyclonedx is missing, it is installed into target/tools.
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
    # cargo-cyclonedx writes a file for each crate of the workspace that the part uses. Only the part's file is kept.
    mv "$part/sbom.json" "$folder/tumble-$part.cdx.json"
    git clean -qfx -- '*/sbom.json' sbom.json
done
ls "$folder"
