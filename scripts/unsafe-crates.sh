#!/usr/bin/env bash
# Lists the crates of the program that contain `unsafe`, with the number of places. A crate that SECURITY.md does not
# name is an error. The sources are those that cargo has downloaded.
set -euo pipefail
cd "$(dirname "$0")/.."

unnamed=0
while read -r name version manifest; do
    sources=$(dirname "$manifest")
    count=$(grep -rhE '\bunsafe\s*(\{|fn|impl|trait|extern)' --include='*.rs' "$sources/src" 2>/dev/null |
        grep -vcE '^\s*//' || true)
    [ "$count" -gt 0 ] || continue
    echo "$name $version: $count"
    if ! grep -q "\`$name\`" SECURITY.md; then
        echo "SECURITY.md does not say what $name has unsafe code for" >&2
        unnamed=1
    fi
done < <(
    # The crates of the program on this system, without those that only build or test it.
    cargo tree --locked -p tumble-cli -e normal --prefix none -f '{p}' | awk '{print $1, substr($2, 2)}' | sort -u >target/program-crates
    cargo metadata --locked --format-version 1 |
        python3 -c '
import json, sys
inside = set(open("target/program-crates").read().splitlines())
for package in json.load(sys.stdin)["packages"]:
    if package["source"] and package["name"] + " " + package["version"] in inside:
        print(package["name"], package["version"], package["manifest_path"])'
)
exit "$unnamed"
