#!/usr/bin/env bash
# Builds the wheel of the Python package into target/wheels, by maturin, for the Python that PYTHON
# names [python3]. One wheel serves every version from 3.10 on; free-threaded Pythons have no stable
# interface, so that one of them (PYTHON=python3.14t) gets a wheel of its own.
set -euo pipefail
cd "$(dirname "$0")/.."

python=${PYTHON:-python3}
environment=target/maturin
if ! [ -x "$environment/bin/maturin" ]; then
    echo "installing maturin into $environment" >&2
    python3 -m venv "$environment"
    "$environment/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9,<2'
fi
python=$(command -v "$python")
"$environment/bin/maturin" build --manifest-path python/Cargo.toml --release --strip \
    --interpreter "$python" --out target/wheels "$@"
