#!/usr/bin/env bash
# Builds the npm package in npm/package and tests it: Node's results are compared with the program's, bit for bit, and
# Chromium's with Node's. The archive that npm installs is in target/npm.
#
#   scripts/npm.sh            builds and tests
#   TUMBLE=PROGRAM scripts/npm.sh   compares with that program
#   scripts/npm.sh --page     also puts the module into the program, for the pages of `tumble view`
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
name=wasm32-unknown-unknown
if ! rustup target list --installed | grep -qx $name; then rustup target add $name; fi

# Without these flags, messages of panics would contain paths of this machine.
registry=${CARGO_HOME:-$HOME/.cargo}/registry/src
# module PROFILE FEATURES: compiles it.
module() {
    RUSTFLAGS="${RUSTFLAGS:-} -C target-feature=+simd128 --remap-path-prefix=$PWD= --remap-path-prefix=$registry=" \
        cargo build --quiet --profile "$1" -p tumble-npm --target $name --no-default-features --features "$2"
    built=$target/$name/$1/tumble_npm.wasm
}

# The hash of the files that determine the module's interface and its results; a test of the program compares it
# (cli/tests/view_live.rs).
sources() {
    cat npm/Cargo.toml npm/src/*.rs formats/src/motion/{packed,sample,world}.rs \
        verify/src/golden.txt | sha1sum | cut -d ' ' -f 1
}
if [ "${1:-}" = --page ]; then
    command -v wasm-opt >/dev/null && command -v zopfli >/dev/null || {
        echo "the engine of pages is made small by wasm-opt and zopfli (Debian's packages binaryen and zopfli)" >&2
        exit 1
    }
    # Without the feature `files`, because pages contain no files to read.
    module page ""
    small=$target/$name/page/tumble.wasm
    wasm-opt -Oz --enable-simd --enable-bulk-memory --enable-nontrapping-float-to-int --enable-sign-ext \
        --enable-mutable-globals --enable-reference-types --enable-multivalue "$built" -o "$small"
    zopfli --i5 -c "$small" >cli/src/commands/view/tumble.wasm.gz
    sources >cli/src/commands/view/tumble.wasm.sources
    printf 'the engine of pages: %s bytes, %s packed\n' "$(stat -c %s "$small")" \
        "$(stat -c %s cli/src/commands/view/tumble.wasm.gz)"
fi
module wasm files
printf 'the module: %s bytes, %s by gzip -9\n' "$(stat -c %s "$built")" "$(gzip -9c "$built" | wc -c)"
cp "$built" npm/package/tumble.wasm
cp LICENSE-* npm/package

# Build the program to compare with, unless TUMBLE names one.
if [ -z "${TUMBLE:-}" ]; then
    cargo build --quiet -p tumble-cli --bin tumble
    TUMBLE=$(realpath "$target/debug/tumble")
fi
export TUMBLE
node --test --test-concurrency=1 --test-reporter=spec npm/tests/
mkdir -p "$target/npm"
archives=$(realpath "$target/npm")
archive=$archives/$(cd npm/package && npm pack --silent --pack-destination "$archives")

# Install the archive by npm, and check its types by TypeScript.
user=$target/npm/user
mkdir -p "$user"
printf '{ "private": true, "type": "module" }\n' >"$user/package.json"
npm install --silent --no-audit --no-fund --prefix "$user" "$archive" typescript@5.9
cp npm/tests/types.mts "$user"
cd "$user"
npx tsc --noEmit --strict --target es2022 --module nodenext --lib es2022,dom types.mts
node --input-type=module -e 'import { load } from "tumble"; console.log(`installed: tumble ${(await load()).version}`)'
