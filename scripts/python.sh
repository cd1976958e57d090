#!/usr/bin/env bash
# Runs the tests of the Python package, in a separate environment in target/python. The extension is built with the same
# options as the other tests, so that compiled crates are shared; scripts/wheel.sh builds wheels. Arguments are passed
# to pytest; `--environment` only makes the environment.
set -euo pipefail
cd "$(dirname "$0")/.."

target=${CARGO_TARGET_DIR:-target}
environment=target/python
requirements=python/tests/requirements.txt
if ! cmp -s "$requirements" "$environment/requirements.txt"; then
    echo "installing NumPy, SciPy, Ray, moto, pytest, mypy and matplotlib into $environment" >&2
    rm -rf "$environment"
    if ! { python3 -m venv "$environment" &&
        "$environment/bin/pip" install --quiet --disable-pip-version-check \
            --requirement "$requirements" &&
        cp "$requirements" "$environment/requirements.txt"; }; then
        rm -rf "$environment"
        echo "the tests of the Python package want python3 with venv, and packages from PyPI;" >&2
        echo "without them nothing is tested (where CI is set this fails)" >&2
        [ -z "${CI:-}" ]
        exit
    fi
fi

[ "${1:-}" != --environment ] || exit 0

# The test `cost` is named, so that cargo chooses the same features as for `cargo test --workspace` and builds nothing a
# second time.
cargo build --quiet --workspace --lib --test cost

# Copies the package as `pip install` would.
site=$("$environment/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
rm -rf "$site/tumble"
cp -r python/package/tumble "$site/tumble"
rm -rf "$site/tumble/__pycache__"
case "$(uname)" in
    Darwin) built=lib_tumble.dylib ;;
    *) built=lib_tumble.so ;;
esac
cp "$target/debug/$built" "$site/tumble/_tumble.abi3.so"
printf '#!%s\nimport sys\nfrom tumble.__main__ import main\nsys.exit(main())\n' \
    "$PWD/$environment/bin/python" >"$environment/bin/tumble"
chmod +x "$environment/bin/tumble"

exec "$environment/bin/python" -m pytest python/tests "$@"
