#!/usr/bin/env bash
# Runs the program's main commands on Windows, by wine, and on Linux, and requires that they write the same bytes
# (`scripts/platforms.sh windows` builds both and calls this). Paths are those of Windows, with drives and `\`.
set -euo pipefail
cd "$(dirname "$0")/../.."
root=$PWD
work=$(mktemp -d "${CARGO_TARGET_DIR:-target}/windows-commands.XXXXXX")
work=$(cd "$work" && pwd)
trap 'rm -rf "$work"' EXIT
cd "$work"
compared=0

# In wine, Linux' files are on the drive Z.
at() { printf 'Z:%s' "$1" | tr / '\\'; }
linux() { "$TUMBLE_LINUX" "$@"; }
windows() { "$WINE" "$TUMBLE_WINDOWS" "$@"; }
same() {
    cmp "$1" "$2"
    compared=$((compared + $(stat -c %s "$1")))
}

echo "eval, by an absolute path and by a relative one"
linux eval "$root/data/pendulum.dat" -o linux.npy
windows eval "$(at "$root/data/pendulum.dat")" -o out.npy
same linux.npy out.npy
mkdir sub
windows eval "$(at "$root/data/pendulum.dat")" -m slerp --fps 60 -o '.\sub\out.csv'
linux eval "$root/data/pendulum.dat" -m slerp --fps 60 -o linux.csv
same linux.csv sub/out.csv

echo "a path of more than 260 characters, and a name that is no ASCII"
long=$work
while [ ${#long} -lt 320 ]; do long=$long/längerer-ordner-mit-einem-namen; done
mkdir -p "$long"
windows eval "$(at "$root/data/pendulum.dat")" -o "$(at "$long/größe.npy")"
same linux.npy "$long/größe.npy"

echo "convert, to a binary format and to text and back"
# The input has the same name in both calls, because written files contain the name of their input.
cp "$root/data/pendulum.dat" .
linux convert pendulum.dat -o linux.glb
windows convert pendulum.dat -o out.glb
same linux.glb out.glb
linux convert out.glb -o linux.bvh
windows convert out.glb -o out.bvh
same linux.bvh out.bvh
windows eval out.bvh --fps 30 -o baked.glb
linux eval out.bvh --fps 30 -o linux-baked.glb
same linux-baked.glb baked.glb

echo "reduce and smooth"
for call in "reduce out.bvh --tolerance 0.1deg" "smooth out.bvh --kernel gaussian:2"; do
    # shellcheck disable=SC2086 # a command with its arguments
    linux $call -o linux-$$.glb && windows $call -o windows-$$.glb
    same linux-$$.glb windows-$$.glb
    rm linux-$$.glb windows-$$.glb
done

echo "a batch that is killed, and resumed"
mkdir library
for seed in $(seq 40); do
    linux generate --boxes 40 --keys 400 --seconds 60 --random --seed "$seed" -o "library/clip$seed.dat"
done
linux eval library -o linux-results --fps 60 >linux.log 2>&1
"$WINE" "$TUMBLE_WINDOWS" eval library -o results --fps 60 >first.log 2>&1 &
batch=$!
deadline=$((SECONDS + 120))
until [ "$(find results -name '*.npy' 2>/dev/null | wc -l)" -ge 5 ]; do
    [ $SECONDS -lt $deadline ] || { echo "no result within two minutes" >&2 && cat first.log >&2 && exit 1; }
    kill -0 $batch || break
    sleep 0.05
done
kill -9 $batch 2>/dev/null || true
wait $batch 2>/dev/null || true
done=$(find results -name '*.npy' | wc -l)
echo "killed after $done of 40 results"
[ "$done" -lt 40 ] || { echo "the batch was over before it was killed" >&2 && exit 1; }
windows eval library -o results --fps 60 --resume >second.log 2>&1 || { cat second.log >&2 && exit 1; }
grep -i 'already complete' second.log | tr -d '\r' || true
for result in linux-results/*.npy; do same "$result" "results/$(basename "$result")"; done
[ "$(find results -type f | wc -l)" -eq "$(find linux-results -type f | wc -l)" ] || {
    diff <(cd linux-results && find . -type f | sort) <(cd results && find . -type f | sort)
}

echo "check finds that all is whole, and a flipped bit"
windows check results | tr -d '\r' | tail -n 1
printf '\x01' | dd of=results/clip7.npy bs=1 seek=1000 conv=notrunc status=none
failed=0
windows check results >check.log 2>&1 || failed=$?
[ $failed -eq 8 ] && grep -q 'clip7' check.log || {
    echo "check gave $failed:" >&2
    cat check.log >&2
    exit 1
}

echo "Ctrl-C while a file is written leaves none"
x86_64-w64-mingw32-gcc -O1 -o ctrl-c.exe "$root/scripts/platforms/ctrl-c.c"
mkdir pressed
failed=0
# Wine provides a console only in a terminal, so `script` creates a terminal.
cat >press.sh <<END
cd pressed
"$WINE" ../ctrl-c.exe .tumble- '$(at "$TUMBLE_WINDOWS")' eval '..\library\clip1.dat' --fps 40000 -o never.npy
END
script -qec 'bash press.sh' /dev/null </dev/null >pressed.log 2>&1 || failed=$?
[ $failed -eq 130 ] && [ -z "$(ls -A pressed)" ] || {
    echo "it gave $failed, and left:" >&2
    ls -A pressed >&2
    cat pressed.log >&2
    exit 1
}

echo "what is refused: an input that is not there, a folder as a file"
failed=0
windows eval 'Z:\nothing\there.dat' -o never.npy >refused.log 2>&1 || failed=$?
[ $failed -eq 4 ] && [ ! -e never.npy ] || { echo "it gave $failed" >&2 && cat refused.log >&2 && exit 1; }
echo "$compared bytes of Windows' files are those of Linux'"
