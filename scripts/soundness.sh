#!/usr/bin/env bash
# Undefined behaviour and data races, looked for where the code has `unsafe` and runs without Vulkan: Miri interprets
# the vectors, the staging lines, the buffers and the C interface's handles; ThreadSanitizer watches the threads.
# Needs Rust's nightly with the components miri and rust-src. Parts can be named: miri, threads.
set -euo pipefail
cd "$(dirname "$0")/.."

host=$(rustc -vV | sed -n 's/^host: //p')
# Interpreting takes a thousand times as long, so properties are tried with few cases.
export PROPTEST_CASES=${PROPTEST_CASES:-3} CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-target/soundness}

interpreted() { # compiler flags: which vectors the processor has
    echo "Miri, $1" >&2
    RUSTFLAGS="$1" MIRIFLAGS="-Zmiri-disable-isolation" \
        cargo +nightly miri test --quiet -p tumble --no-default-features --lib -- \
        simd:: cpu::streaming cpu::scratch output::buffer shared_memory threads::exclusive
}

miri() {
    interpreted ""
    case "$host" in x86_64-*) interpreted "-C target-feature=+avx2" ;; esac
    echo "Miri, the C interface" >&2
    MIRIFLAGS="-Zmiri-disable-isolation" cargo +nightly miri test --quiet -p tumble-capi --no-default-features --lib -- tests::a_handle tests::handles_may tests::null
}

threads() {
    echo "ThreadSanitizer" >&2
    # The standard library is compiled too: its locks would not be seen otherwise.
    RUSTFLAGS="-Z sanitizer=thread" \
        cargo +nightly test --quiet -Z build-std --target "$host" -p tumble --no-default-features --lib -- \
        threads:: cpu:: output::buffer memory::
    RUSTFLAGS="-Z sanitizer=thread" \
        cargo +nightly test --quiet -Z build-std --target "$host" -p tumble --no-default-features --test all -- \
        threads:: stream::
}

for part in "${@:-miri threads}"; do
    for one in $part; do
        case "$one" in
            miri | threads) "$one" ;;
            *)
                echo "no part is called $one: miri, threads" >&2
                exit 2
                ;;
        esac
    done
done
