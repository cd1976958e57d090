#!/usr/bin/env bash
# Every test, on this machine as on CI. Installs what the tests need where it is
# missing: a software Vulkan driver (lavapipe), the validation layer, spirv-val, valgrind,
# which counts instructions, and chromium, which opens the pages of `tumble view`.
set -euo pipefail
cd "$(dirname "$0")/.."

# Everything is built once from a clean clone: what would make a second build quicker makes the
# first one slower. Each unit that code is generated in makes the small functions of the others again:
# four are enough for two cores.
if [ -n "${CI:-}" ]; then
    export CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=0
    export CARGO_PROFILE_DEV_CODEGEN_UNITS=4 CARGO_PROFILE_DEV_BUILD_OVERRIDE_CODEGEN_UNITS=4
fi

fetching=()
has_driver() { compgen -G '/usr/share/vulkan/icd.d/lvp_icd*.json' >/dev/null; }
has_layer() { compgen -G '/usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json' >/dev/null; }
has_browser() { command -v chromium || command -v chromium-browser || command -v google-chrome; }
has_loader() { ldconfig -p 2>/dev/null | grep -q 'libvulkan\.so\.1'; }

if ! has_driver || ! has_layer || ! has_loader || ! command -v spirv-val >/dev/null ||
    ! command -v valgrind >/dev/null || ! has_browser >/dev/null; then
    if command -v apt-get >/dev/null; then
        sudo=""
        [ "$(id -u)" -eq 0 ] || sudo="sudo"
        echo "installing lavapipe, the validation layer, spirv-tools, valgrind and chromium" >&2
        $sudo apt-get update -qq
        DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends \
            libvulkan1 mesa-vulkan-drivers vulkan-validationlayers spirv-tools valgrind \
            chromium >/dev/null
    else
        echo "the tests want a Vulkan loader, lavapipe, VK_LAYER_KHRONOS_validation, spirv-val," >&2
        echo "valgrind and chromium; install your system's packages for them (Debian: libvulkan1" >&2
        echo "mesa-vulkan-drivers vulkan-validationlayers spirv-tools valgrind chromium). Tests" >&2
        echo "without them say so and compare nothing." >&2
    fi
fi

# SwiftShader, a second and independent driver, comes inside Debian's chromium; where
# it is there, every test that walks the devices walks it too.
swiftshader=/usr/lib/chromium/vk_swiftshader_icd.json
if [ -z "${VK_DRIVER_FILES:-}${VK_ADD_DRIVER_FILES:-}" ] && [ -e "$swiftshader" ]; then
    export VK_ADD_DRIVER_FILES="$swiftshader"
fi

# Peers to compare with, in an environment of their own (cli/tests/peers).
fetch_peers() {
    peers=target/peers
    if ! "$peers/bin/python" -c 'import numpy, scipy, splines, pygeodesic' 2>/dev/null; then
        if ! python3 -c 'import venv, ensurepip' 2>/dev/null && command -v apt-get >/dev/null; then
            sudo=""
            [ "$(id -u)" -eq 0 ] || sudo="sudo"
            $sudo apt-get update -qq
            DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends \
                python3-venv >/dev/null
        fi
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

# Khronos' validator of glTF files (formats/tests/validator).
fetch_validator() {
    validator=target/validator
    package=formats/tests/validator/package.json
    if ! cmp -s "$package" "$validator/package.json" ||
        ! (cd "$validator" && node -e 'require("gltf-validator")') 2>/dev/null; then
        if ! { command -v node && command -v npm; } >/dev/null && command -v apt-get >/dev/null; then
            sudo=""
            [ "$(id -u)" -eq 0 ] || sudo="sudo"
            $sudo apt-get update -qq
            DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends \
                nodejs npm >/dev/null
        fi
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

# A newer lavapipe, and AMD's compiler for cards of today (tests/mesa), come with them.
# One after another where something of the system's is missing, for apt takes turns; else beside each
# other and beside what is compiled first.
if command -v node >/dev/null && command -v npm >/dev/null &&
    python3 -c 'import venv, ensurepip' 2>/dev/null; then
    for fetch in fetch_peers fetch_validator ./scripts/mesa.sh './scripts/python.sh --environment'; do
        $fetch &
        fetching+=($!)
    done
else
    fetch_peers
    fetch_validator
    ./scripts/mesa.sh
fi

# The oldest Rust that Cargo.toml promises, where it is at hand and not the one in use.
oldest=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
if ! rustc --version | grep -q "^rustc $oldest\b" &&
    command -v rustup >/dev/null && rustup run "$oldest" rustc --version >/dev/null 2>&1; then
    CARGO_TARGET_DIR=target/oldest rustup run "$oldest" cargo check --workspace --all-targets --quiet
fi

# What the dependencies may be (deny.toml), where the tool is installed.
if cargo deny --version >/dev/null 2>&1; then
    cargo deny --log-level error check bans licenses sources
fi

if cargo fmt --version >/dev/null 2>&1; then cargo fmt --check; fi
if cargo clippy --version >/dev/null 2>&1; then
    cargo clippy --workspace --all-targets --quiet -- -D warnings
    # No other call compiles the tests that run on demand.
    cargo clippy --workspace --test load --quiet -- -D warnings
fi
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --document-private-items --quiet
for fetch in "${fetching[@]}"; do wait "$fetch"; done
# Four seconds for each fuzz target, a quarter for motion files; ten minutes each are FUZZ_SECONDS=600.
export FUZZ_SECONDS=${FUZZ_SECONDS:-4}
cargo test --workspace --no-run --quiet
# The Python package waits for processes that it starts more than it computes: it is tested meanwhile.
said=target/python.log
./scripts/python.sh --color=yes >"$said" 2>&1 &
python=$!
failed=0
cargo test --workspace --no-fail-fast || failed=$?
wait "$python" || failed=$?
cat "$said"
exit "$failed"
