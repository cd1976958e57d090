#!/usr/bin/env bash
# Makes recipes for conda, Homebrew and vcpkg in target/recipes, from the templates in packaging/. The version, the
# description and the licence are those of Cargo.toml, the hashes those of the archive of the sources, which is made in
# the same folder. The flake for Nix (packaging/nix) reads Cargo.toml itself.
#
# usage: scripts/recipes.sh [ADDRESS]   the repository's address, from which the release's archive can be loaded
set -euo pipefail
cd "$(dirname "$0")/.."
homepage=${1:-https://example.org/tumble}
target=${CARGO_TARGET_DIR:-target}
# A field's first value in a Cargo.toml.
field() { sed -n "s/^$1 = \"\(.*\)\"/\1/p" "$2" | head -n 1; }
version=$(field version Cargo.toml)
license=$(field license Cargo.toml)
description=$(field description Cargo.toml)
folder=$target/recipes
archive=tumble-$version.tar.gz
rm -rf "$folder"
mkdir -p "$folder"
git archive --format=tar --prefix="tumble-$version/" HEAD | gzip -9n >"$folder/$archive"
list=$(sed 's/\(.*\) OR \(.*\)/"\1", "\2"/' <<<"$license")
for recipe in conda/recipe.yaml homebrew/tumble.rb vcpkg/vcpkg.json vcpkg/portfile.cmake; do
    mkdir -p "$folder/$(dirname "$recipe")"
    sed -e "s|@VERSION@|$version|g" -e "s|@LICENSE@|$license|g" -e "s|@LICENSE_LIST@|$list|g" \
        -e "s|@DESCRIPTION@|$description|g" -e "s|@HOMEPAGE@|$homepage|g" \
        -e "s|@ARCHIVE_URL@|$homepage/releases/download/v$version/$archive|g" \
        -e "s|@SHA256@|$(sha256sum "$folder/$archive" | cut -d ' ' -f 1)|g" \
        -e "s|@SHA512@|$(sha512sum "$folder/$archive" | cut -d ' ' -f 1)|g" "packaging/$recipe" >"$folder/$recipe"
    if grep -n '@[A-Z_0-9]*@' "$folder/$recipe"; then
        echo "$recipe: these fields have no value" >&2
        exit 1
    fi
done
find "$folder" -type f | sort
