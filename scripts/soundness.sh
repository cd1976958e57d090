#!/usr/bin/env bash
# Looks for undefined behaviour and data races in code that has `unsafe` and runs without Vulkan: Miri interprets the
# vectors, the staging lines, the buffers and the C interface's handles; ThreadSanitizer observes the threads. ufbx,
# which is C, reads damaged files with gcc's sanitizers for UFBX_SECONDS (60 by default). Needs Rust's nightly with the
# components miri and rust-src, and gcc. Parts can be named: miri, threads, ufbx.
set -euo pipefail
cd "$(dirname "$0")/.."

host=$(rustc -vV | sed -n 's/^host: //p')
# Interpreting takes a thousand times as long, so property tests use few cases.
export PROPTEST_CASES=${PROPTEST_CASES:-3} CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-target/soundness}

interpreted() { # compiler flags: which vectors the processor has
    echo "Miri, $1" >&2
    RUSTFLAGS="$1" MIRIFLAGS="-Zmiri-disable-isolation" \
        cargo +nightly miri test --quiet -p tumble --no-default-features --lib -- \
        simd:: cpu::streaming cpu::scratch shared_memory threads::exclusive
}

miri() {
    interpreted ""
    case "$host" in x86_64-*) interpreted "-C target-feature=+avx2" ;; esac
    echo "Miri, the C interface" >&2
    MIRIFLAGS="-Zmiri-disable-isolation" \
        cargo +nightly miri test --quiet -p tumble-capi --no-default-features --lib -- tests::a_handle tests::handles_may tests::null
}

threads() {
    echo "ThreadSanitizer" >&2
    # The drivers are not compiled with ThreadSanitizer, so it does not see their locks. Therefore reports about
    # functions that drivers call are suppressed.
    mkdir -p "$CARGO_TARGET_DIR"
    printf 'called_from_lib:%s\n' libvulkan_lvp.so libvk_swiftshader.so >"$CARGO_TARGET_DIR/suppressions"
    export TSAN_OPTIONS="suppressions=$(realpath "$CARGO_TARGET_DIR")/suppressions"
    # The standard library is compiled with it too; otherwise its locks would not be seen.
    RUSTFLAGS="-Z sanitizer=thread" \
        cargo +nightly test --quiet -Z build-std --target "$host" -p tumble --no-default-features --lib -- \
        threads:: cpu:: output::buffer memory::
    RUSTFLAGS="-Z sanitizer=thread" \
        cargo +nightly test --quiet -Z build-std --target "$host" -p tumble --no-default-features --test all -- \
        threads:: stream:: --skip threads_that_the_system_refuses_are_an_error
}

ufbx() {
    echo "ufbx, by sanitizers" >&2
    local sources manifest
    manifest=$(cargo metadata --locked --format-version 1 | python3 -c '
import json, sys
print(next(p["manifest_path"] for p in json.load(sys.stdin)["packages"] if p["name"] == "ufbx"))')
    sources=$(dirname "$manifest")/ufbx
    mkdir -p "$CARGO_TARGET_DIR"
    # Without UFBX_UBSAN, ufbx shifts by more bits than a word has. x86-64 defines this, C does not.
    gcc -O1 -g -DUFBX_UBSAN=1 -fsanitize=address,undefined -fno-sanitize-recover=all -I"$sources" \
        fuzz/c/ufbx.c "$sources/ufbx.c" -lm -o "$CARGO_TARGET_DIR/ufbx"
    "$CARGO_TARGET_DIR/ufbx" "${UFBX_SECONDS:-60}" formats/tests/fixtures/fbx/*.fbx
}

for part in "${@:-miri threads ufbx}"; do
    for one in $part; do
        case "$one" in
            miri | threads | ufbx) "$one" ;;
            *)
                echo "no part is called $one: miri, threads, ufbx" >&2
                exit 2
                ;;
        esac
    done
done
