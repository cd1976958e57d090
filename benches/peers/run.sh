#!/usr/bin/env bash
# Compares Tumble with the libraries that people use today: the same keys, in turns, in one run. Everything that is
# needed is built or installed in target/race: the Rust libraries, compiled for this machine's vectors (Tumble chooses
# its vectors at run time), Python libraries from PyPI, three.js from npm. Libraries that are missing are named under
# the table.
#
#   benches/peers/run.sh                prints the tables of docs/figures.md: many samples a call
#   benches/peers/run.sh --poses        prints the table of docs/speed.md: one pose of 60 joints a call
#   benches/peers/run.sh --write        writes them there
#   benches/peers/run.sh --bevy         with Bevy's smooth curve, which takes ten minutes to compile
#   benches/peers/run.sh --rounds 9     turns; 5 by default
#   benches/peers/run.sh --program X    with the program X too, called as `X KEYS FOLDER`; it prints a line of
#                                       JSON for each of its rows, as ozz/src/main.rs does
#
# PEERS_PYTHON names a Python that has NumPy, SciPy and other libraries to compare with (roma and torch).
set -euo pipefail
cd "$(dirname "$0")/../.."

place=$PWD/target/race
mkdir -p "$place/rows"
race=()
features=()
poses=
more=
while [ $# -gt 0 ]; do
    case "$1" in
    --bevy) features=(--features bevy) ;;
    --poses) poses=1 ;;
    --write) race+=(--write) ;;
    --rounds) race+=(--rounds "$2") && shift ;;
    --program) race+=(--program "$2") && more=1 && shift ;;
    *) sed -n '2,15s/^# \?//p' benches/peers/run.sh >&2 && exit 2 ;;
    esac
    shift
done
[ ${#features[@]} -gt 0 ] || race+=(--missing "Bevy's smooth curve: --bevy")

# build PACKAGE [ARGUMENT ...]: for this machine's vectors
build() {
    local manifest=benches/peers/$1Cargo.toml && shift
    RUSTFLAGS="-C target-cpu=native" CARGO_TARGET_DIR=$place \
        cargo "$@" build --quiet --release --manifest-path "$manifest" "${features[@]}"
}

# Version 0.11 is written for a nightly in which `Mask::to_simd` was `to_int`: a copy is compiled with the new name.
build_ozz() {
    local manifest=benches/peers/ozz/Cargo.toml source
    source=$(cargo +nightly metadata --quiet --format-version 1 --manifest-path "$manifest" |
        "$python" -c 'import json, pathlib, sys
for package in json.load(sys.stdin)["packages"]:
    if package["name"] == "ozz-animation-rs": print(pathlib.Path(package["manifest_path"]).parent)') || return 1
    rm -rf "$place/ozz-animation-rs" && cp -r "$source" "$place/ozz-animation-rs" || return 1
    sed -i 's/\.to_int()/.to_simd()/' "$place"/ozz-animation-rs/src/*.rs || return 1
    build ozz/ +nightly --config "patch.crates-io.ozz-animation-rs.path='$place/ozz-animation-rs'"
}

build ""
program=$place/release/tumble-peers

python=${PEERS_PYTHON:-$place/python/bin/python}
if [ -z "${PEERS_PYTHON:-}" ] && ! "$python" -c 'import numpy, scipy' 2>/dev/null; then
    echo "installing NumPy and SciPy into $place/python" >&2
    python3 -m venv "$place/python"
    "$place/python/bin/pip" install --quiet --disable-pip-version-check numpy scipy
fi

if [ -n "$poses" ]; then
    [ -n "$more" ] || race+=(--missing "ozz-animation and ACL in C++: --program")
    "$program" write-poses "$place/rows/poses.bin"
    race+=(--poses --program "$program|race-poses")
    features=()
    if ! cargo +nightly --version >/dev/null 2>&1; then
        race+=(--missing "ozz-animation-rs: Rust's nightly toolchain is not installed")
    elif build_ozz 2>"$place/ozz.log"; then
        race+=(--program "$place/release/tumble-peers-ozz")
    else
        race+=(--missing "ozz-animation-rs: it does not compile here, see target/race/ozz.log")
    fi
    exec "$python" benches/peers/race.py "$place/rows" "${race[@]}"
fi

"$program" write "$place/rows/keys.bin"
race+=(--program "$program|race")
race+=(--program "$python|benches/peers/scipy_peers.py")

if command -v node >/dev/null; then
    if ! [ -d "$place/node_modules/three" ]; then
        npm install --silent --no-audit --no-fund --prefix "$place" three@0.187.0
    fi
    race+=(--program "env|NODE_PATH=$place/node_modules|node|benches/peers/three_peers.js")
else
    race+=(--missing "three.js: node is not installed")
fi

exec "$python" benches/peers/race.py "$place/rows" "${race[@]}"
