#!/usr/bin/env bash
# The tests of the Python package, in an environment of their own under target/python. The extension
# is built as the tests' other programs are, so that it shares what they are built of; wheels are
# built by scripts/wheel.sh. Arguments go to pytest; `--environment` makes the environment and nothing else.
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

# Naming a test makes cargo choose the features that `cargo test --workspace` has, and nothing is
# built a second time.
cargo build --quiet --workspace --lib --test cost

# The package as `pip install` installs it.
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
