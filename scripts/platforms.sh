#!/usr/bin/env bash
# Compares the bits on other processors and systems, by emulators. It is run on demand, because it takes an hour on two
# cores, too long for CI. docs/platforms.md has the results.
#
#   scripts/platforms.sh                     all parts
#   scripts/platforms.sh wasm windows        these
#
#   aarch64   Linux on aarch64, by qemu: recorded hashes, the CPU's tests of the engine and of files
#   wasm      WebAssembly, by Node: recorded hashes, the CPU's tests, without and with its vectors
#   windows   Windows on x86-64, by wine: recorded hashes, the CPU's tests, the program's commands
#   types     macOS and Android: the engine, its proof, files and routes type-check
#
# Each step prints its comparison, and the script stops at the first step that fails.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
export CARGO_TARGET_DIR=${TUMBLE_PLATFORMS_DIR:-$root/target/platforms}
mkdir -p "$CARGO_TARGET_DIR"
# Settings with which less code is generated and linked.
export CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=0 CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16

step() { printf '\n== %s\n' "$*"; }

# Installs missing packages of Debian. The arguments are pairs: a file of a package, and the package.
packages() {
    local missing=()
    while [ $# -gt 0 ]; do
        [ -e "$1" ] || missing+=("$2")
        shift 2
    done
    [ ${#missing[@]} -eq 0 ] && return
    command -v apt-get >/dev/null || {
        echo "these packages of Debian's, or your system's for the same, are missing: ${missing[*]}" >&2
        exit 1
    }
    local sudo=""
    [ "$(id -u)" -eq 0 ] || sudo=sudo
    echo "installing ${missing[*]}" >&2
    $sudo apt-get update -qq
    DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

# Installs Rust's standard library for a target.
target() {
    command -v rustup >/dev/null || {
        echo "rustup is needed, which has the standard library for $1" >&2
        exit 1
    }
    rustup target list --installed | grep -qx "$1" || rustup target add "$1"
}

aarch64() {
    packages /usr/bin/aarch64-linux-gnu-gcc gcc-aarch64-linux-gnu \
        /usr/aarch64-linux-gnu/lib/crt1.o libc6-dev-arm64-cross \
        /usr/bin/qemu-aarch64-static qemu-user-static
    local name=aarch64-unknown-linux-gnu
    target $name
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64-static -L /usr/aarch64-linux-gnu"
    step "aarch64: the CPU's tests"
    scripts/cpu-tests.sh $name
}

wasm() {
    packages /usr/bin/node nodejs
    local name=wasm32-wasip1 vectors
    target $name
    # Without the flag, Node 20 crashes after a module's memory has grown, because it reads the old address.
    local node="node --no-warnings --no-turbo-fast-api-calls"
    export CARGO_TARGET_WASM32_WASIP1_RUNNER="$node $root/scripts/platforms/wasi.mjs"
    for vectors in -simd128 +simd128; do
        step "wasm32, $vectors: the CPU's tests"
        RUSTFLAGS="${RUSTFLAGS:-} -C target-feature=$vectors" scripts/cpu-tests.sh $name
    done
}

# Runs a Windows program.
wine() { "$wine" "$@"; }

windows() {
    packages /usr/bin/x86_64-w64-mingw32-gcc gcc-mingw-w64-x86-64-win32 /usr/lib/wine/wine64 wine64
    local name=x86_64-pc-windows-gnu program
    target $name
    wine=$(command -v wine64 || echo /usr/lib/wine/wine64)
    export WINEDEBUG=-all WINEPREFIX=$CARGO_TARGET_DIR/wine
    mkdir -p "$WINEPREFIX"
    wine cmd /c ver | tr -d '\r'
    local system=$WINEPREFIX/drive_c/windows/system32
    [ -e "$system/bcryptprimitives.dll" ] ||
        x86_64-w64-mingw32-gcc -shared -O1 -o "$system/bcryptprimitives.dll" \
            scripts/platforms/bcryptprimitives.c -ladvapi32
    export CARGO_TARGET_X86_64_PC_WINDOWS_GNU_RUNNER=$wine
    step "Windows: the CPU's tests"
    scripts/cpu-tests.sh $name
    step "Windows: the program's commands, beside Linux's"
    cargo build --quiet -p tumble-cli --no-default-features --bin tumble
    cargo build --quiet -p tumble-cli --no-default-features --bin tumble --target $name
    program=$CARGO_TARGET_DIR/$name/debug/tumble.exe
    TUMBLE_LINUX=$CARGO_TARGET_DIR/debug/tumble TUMBLE_WINDOWS=$program WINE=$wine \
        scripts/platforms/windows-commands.sh
}

types() {
    local name
    for name in aarch64-apple-darwin aarch64-linux-android; do
        target $name
        step "$name: the engine, its proof, files and routes type-check"
        cargo check --quiet -p tumble -p tumble-exact -p tumble-formats -p tumble-routes -p tumble-verify \
            --no-default-features --features tumble/vulkan,tumble-verify/vulkan --target $name
        echo "they do"
    done
}

[ $# -gt 0 ] || set -- aarch64 wasm windows types
for part in "$@"; do
    case $part in
    aarch64 | wasm | windows | types) ;;
    *)
        echo "there is no part \`$part\`; there are aarch64, wasm, windows and types" >&2
        exit 2
        ;;
    esac
done
for part in "$@"; do "$part"; done
step "done: $*"
