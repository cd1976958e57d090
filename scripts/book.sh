#!/usr/bin/env bash
# Makes target/book, the guide as a book, and looks for links in it that lead nowhere. mdBook is installed
# into target/tools where this system has none; --no-install says so instead.
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
    # Without optimisation it is there in half the time, and forty pages take a second either way.
    cargo install --quiet --locked --debug --root "$tools" --version "$version" \
        --no-default-features --features search mdbook
fi
command -v python3 >/dev/null || { echo "the book wants python3" >&2; exit 1; }
mdbook build
python3 scripts/book.py check target/book
