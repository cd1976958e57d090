#!/usr/bin/env bash
# Makes target/book, the guide as a book, and checks its links. If mdBook is not installed, it is installed into
# target/tools; with --no-install, only a message is printed.
set -euo pipefail
cd "$(dirname "$0")/.."

version=0.5.4
tools=$PWD/target/tools
export PATH="$tools/bin:$PATH"
if ! command -v mdbook >/dev/null; then
    if [ "${1:-}" = --no-install ]; then
        echo "mdbook is not installed: the book was not made (scripts/book.sh installs it)" >&2
        exit 0
    fi
    echo "installing mdbook $version into $tools" >&2
    # Without optimisation, mdBook is compiled in half the time; the book takes a second in both cases.
    cargo install --quiet --locked --debug --root "$tools" --version "$version" \
        --no-default-features --features search mdbook
fi
command -v python3 >/dev/null || { echo "the book wants python3" >&2; exit 1; }
mdbook build
python3 scripts/book.py check target/book
