#!/usr/bin/env bash
# Builds the wheel of the Python package into target/wheels, by maturin, for the Python that PYTHON names [python3]. One
# wheel serves every version from 3.10 on. Free-threaded Pythons have no stable interface, so each of their versions
# needs a separate wheel (PYTHON=python3.14t). On Linux, zig links the wheel with glibc 2.28 (Debian 10, RHEL 8, Ubuntu
# 18.10), whatever this system has, and maturin refuses a wheel that needs a newer one. GLIBC=system links with this
# system's glibc.
set -euo pipefail
cd "$(dirname "$0")/.."

python=${PYTHON:-python3}
target=${CARGO_TARGET_DIR:-target}
environment=$target/maturin
requirements='maturin[zig]>=1.9,<2'
if ! [ "$(cat "$environment/requirements.txt" 2>/dev/null)" = "$requirements" ]; then
    echo "installing maturin and zig into $environment" >&2
    rm -rf "$environment"
    python3 -m venv "$environment"
    "$environment/bin/pip" install --quiet --disable-pip-version-check "$requirements"
    echo "$requirements" >"$environment/requirements.txt"
fi
python=$(command -v "$python")
glibc=()
if [ "$(uname)" = Linux ] && [ "${GLIBC:-2.28}" != system ]; then
    glibc=(--zig --compatibility manylinux_2_28)
    # maturin looks for zig in PATH.
    PATH=$(cd "$environment" && pwd)/bin:$PATH
fi
"$environment/bin/maturin" build --manifest-path python/Cargo.toml --release --strip \
    --interpreter "$python" --out "$target/wheels" ${glibc[@]+"${glibc[@]}"} "$@"
