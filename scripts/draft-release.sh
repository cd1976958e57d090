#!/usr/bin/env bash
# Makes a draft of a release by GitHub's program `gh`, with all files below a folder. GITHUB_REF_NAME is the tag, which
# must be the version of Cargo.toml. Nothing is published.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:?the folder with the files}
tag=${GITHUB_REF_NAME:?the tag}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
[ "$tag" = "v$version" ] || {
    echo "the tag is $tag, and Cargo.toml has version $version" >&2
    exit 1
}
files=()
while IFS= read -r file; do files+=("$file"); done < <(find "$folder" -type f | sort)
[ ${#files[@]} -gt 0 ] || {
    echo "there is no file below $folder" >&2
    exit 1
}
# One list with the checksums of all files, in addition to the separate one of each file.
sums=$folder/SHA256SUMS
(cd "$folder" && find . -type f ! -name SHA256SUMS ! -name '*.sha256' -exec sha256sum {} + | sed -E 's|  .*/|  |' | sort -k 2) >"$sums"
files+=("$sums")
gh release create "$tag" --draft --title "Tumble $version" --notes-file CHANGELOG.md "${files[@]}"
