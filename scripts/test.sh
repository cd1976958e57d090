#!/usr/bin/env bash
# Runs every test, on this machine and in CI. Installs the tools of the tests that are missing: a software Vulkan driver
# (lavapipe), the validation layer, spirv-val, valgrind, which counts instructions, and chromium, which opens the pages
# of `tumble view`; Node for Khronos' validator of glTF files, Python with venv for the peers and the Python package,
# and qemu, which executes aarch64's instructions.
set -euo pipefail
cd "$(dirname "$0")/.."

# Tests count the instructions of functions as they are released. Incremental compilation inlines fewer functions, so it
# is off.
export CARGO_INCREMENTAL=0
# CI builds everything once, from a clean clone, so settings that make only a second build faster are off. Each codegen
# unit compiles small functions of the others again, so there are only four, which are enough for two cores.
if [ -n "${CI:-}" ]; then
    export CARGO_PROFILE_DEV_DEBUG=0
    export CARGO_PROFILE_DEV_CODEGEN_UNITS=4 CARGO_PROFILE_DEV_BUILD_OVERRIDE_CODEGEN_UNITS=4
    export RUSTFLAGS="${RUSTFLAGS:-} -D warnings"
fi

# Prints the packages of Debian that are missing here.
missing_packages() {
    compgen -G '/usr/share/vulkan/icd.d/lvp_icd*.json' >/dev/null || echo mesa-vulkan-drivers
    compgen -G '/usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json' >/dev/null ||
        echo vulkan-validationlayers
    PATH=$PATH:/sbin ldconfig -p 2>/dev/null | grep 'libvulkan\.so\.1' >/dev/null || echo libvulkan1
    command -v spirv-val >/dev/null || echo spirv-tools
    command -v valgrind >/dev/null || echo valgrind
    command -v chromium >/dev/null || command -v chromium-browser >/dev/null ||
        command -v google-chrome >/dev/null || echo chromium
    command -v node >/dev/null || echo nodejs
    command -v npm >/dev/null || echo npm
    python3 -c 'import venv, ensurepip' 2>/dev/null || echo python3-venv
    [ "$(uname -m)" = aarch64 ] || command -v qemu-aarch64-static >/dev/null || echo qemu-user-static
}

install_packages() {
    echo "installing $*" >&2
    $sudo apt-get update -qq
    DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

# Installs the libraries to compare with, in a separate environment (cli/tests/peers).
fetch_peers() {
    peers=target/peers
    if ! "$peers/bin/python" -c 'import numpy, scipy, splines, pygeodesic' 2>/dev/null; then
        echo "installing SciPy, splines and pygeodesic into $peers" >&2
        rm -rf "$peers"
        if ! { python3 -m venv "$peers" &&
            "$peers/bin/pip" install --quiet --requirement cli/tests/peers/requirements.txt; }; then
            rm -rf "$peers"
            echo "the peers' test wants python3 with venv, and SciPy, splines and pygeodesic from PyPI; without" >&2
            echo "them it says so and compares nothing (where CI is set it fails)" >&2
        fi
    fi
}

# Installs Khronos' validator of glTF files (formats/tests/validator).
fetch_validator() {
    validator=target/validator
    package=formats/tests/validator/package.json
    if ! cmp -s "$package" "$validator/package.json" ||
        ! (cd "$validator" && node -e 'require("gltf-validator")') 2>/dev/null; then
        echo "installing gltf-validator into $validator" >&2
        rm -rf "$validator"
        mkdir -p "$validator"
        if ! { cp "$package" "$validator" &&
            npm install --silent --no-audit --no-fund --prefix "$validator"; }; then
            rm -rf "$validator"
            echo "the validator's tests want node, npm and gltf-validator from npm; without them they" >&2
            echo "say so and validate nothing (where CI is set they fail)" >&2
        fi
    fi
}

# Fetches the tools that the tests need, while the workspace is compiled. scripts/mesa.sh unpacks a newer lavapipe and
# compilers for graphics cards (tests/mesa).
fetch() {
    [ $# -eq 0 ] || install_packages "$@"
    running=()
    for part in fetch_peers fetch_validator ./scripts/mesa.sh './scripts/python.sh --environment' \
        './scripts/aarch64.sh --fetch'; do
        $part &
        running+=($!)
    done
    failed=0
    for part in "${running[@]}"; do wait "$part" || failed=$?; done
    return $failed
}

sudo=""
missing=$(missing_packages | tr '\n' ' ')
if [ -n "$missing" ]; then
    if command -v apt-get >/dev/null; then
        # A password is asked for here, because commands in the background have no terminal.
        [ "$(id -u)" -eq 0 ] || { sudo="sudo" && { sudo -n true 2>/dev/null || sudo -v || true; }; }
    else
        echo "the tests want these packages of Debian's, or your system's for the same: $missing." >&2
        echo "Tests without them say so and compare nothing." >&2
        missing=""
    fi
fi
# shellcheck disable=SC2086 # names of packages, with blanks between them
fetch $missing </dev/null &
fetching=$!
trap 'wait "$fetching" 2>/dev/null || true' EXIT

# CI only checks the format, and treats warnings of the compiler as errors. The other lints and the documentation would
# take a third of its time.
if [ -z "${CI:-}" ]; then
    ./scripts/lint.sh
elif cargo fmt --version >/dev/null 2>&1; then
    cargo fmt --check
fi
# The tests and the Python package's extension are compiled in one build, because two builds one after another would
# leave a core idle.
cargo build --workspace --lib --bins --tests --examples --quiet
wait "$fetching" || {
    echo "what the tests need could not be fetched: see above" >&2
    exit 1
}

# SwiftShader is a second, independent driver, which is part of Debian's package chromium. If it is installed, every
# test of all devices also tests it.
swiftshader=/usr/lib/chromium/vk_swiftshader_icd.json
if [ -z "${VK_DRIVER_FILES:-}${VK_ADD_DRIVER_FILES:-}" ] && [ -e "$swiftshader" ]; then
    export VK_ADD_DRIVER_FILES="$swiftshader"
fi

# Each fuzz target runs for three seconds, files of each format for about a quarter of that. FUZZ_SECONDS=600 is ten
# minutes each.
export FUZZ_SECONDS=${FUZZ_SECONDS:-3}
# The Python package's tests mostly wait for processes, and other tests wait for the last of them. So they run at the
# same time as the engine's tests, which keeps both cores busy.
beside=()
start_beside() { # a file for what it says, a command
    local said=$1
    shift
    "$@" >"$said" 2>&1 &
    beside+=("$!:$said")
}
others() {
    local failed=0
    cargo test --workspace --no-fail-fast --test cost --test fuzz || failed=$?
    # The messages of the program fill thousands of lines, so they are written into a file.
    cargo test --workspace --test options 2>target/options.log || {
        failed=$?
        tail -n 100 target/options.log
    }
    cargo test --workspace --no-fail-fast --doc || failed=$?
    # This runs last, because a core is free while the program's tests wait for each other.
    ./scripts/aarch64.sh || failed=$?
    return $failed
}
start_beside target/others.log others
start_beside target/python.log ./scripts/python.sh --color=yes
failed=0
cargo test --workspace --no-fail-fast --lib --bins --test all 2>&1 | tee target/all.log || failed=$?
for one in "${beside[@]}"; do
    wait "${one%%:*}" || failed=$?
    cat "${one#*:}"
done
if [ "$failed" -ne 0 ]; then
    # The failed tests are listed at the end of the log, which people see first.
    echo "these failed (exit $failed):"
    grep -hE "^test .* FAILED|^thread .* panicked at|^error: |test failed, to rerun|^FAILED |^ERROR " \
        target/all.log target/others.log target/python.log || echo "no test: see the log"
fi
exit "$failed"
