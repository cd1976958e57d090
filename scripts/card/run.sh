#!/usr/bin/env bash
# Proves the card of this machine: lists the devices, compares their bits with the CPU's, runs the validation layer, and
# measures their speed and that of other variants of the kernels. It takes at most twelve minutes and needs no network.
# All results and a summary are in one folder next to this file.
#
#   ./run.sh                      the first Vulkan device
#   ./run.sh --device NAME        another: index, part of the name or uuid:UUID
#   ./run.sh --driver FILE        a driver in an unusual place: its manifest (.json) or its library (.so)
#   ./run.sh --quick              in four minutes
set -u
here=$(cd "$(dirname "$0")" && pwd)
cd "$here" || exit 1

# For each step in seconds: the program's time limit, and the time after which the step is killed.
prove_seconds=190 prove_limit=215
validate_seconds=70 validate_limit=110
lab_seconds=150 lab_limit=190 chosen_seconds=40 chosen_limit=60
devices_limit=45 bench_limit=95
device=() driver=""
while [ $# -gt 0 ]; do
    case "$1" in
    --device) device=(--device "${2:?--device needs a name}") && shift 2 ;;
    --driver) driver=${2:?--driver needs a file} && shift 2 ;;
    --quick)
        prove_seconds=40 prove_limit=60 validate_seconds=25 validate_limit=40
        lab_seconds=40 lab_limit=60 chosen_seconds=20 chosen_limit=35
        devices_limit=15 bench_limit=20
        shift
        ;;
    *) sed -n '2,10s/^# \{0,1\}//p' "$0" && exit 2 ;;
    esac
done

# If this folder cannot be written, the results are written into a temporary folder.
name="results-$(uname -n)-$(date -u +%Y%m%d-%H%M%S)"
results=$here/$name
mkdir "$results" 2>/dev/null || results=$(mktemp -d)/$name && mkdir -p "$results" || exit 1
summary=$results/summary.txt
say() { echo "$*" | tee -a "$summary"; }

# Use the system's Vulkan loader if there is one, as other programs here do; otherwise the archive's.
if ! (PATH=$PATH:/sbin:/usr/sbin ldconfig -p 2>/dev/null | grep -q 'libvulkan\.so\.1'); then
    export LD_LIBRARY_PATH=$here/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    loader="the loader of this archive"
else
    loader="the system's loader"
fi
export VK_LAYER_PATH=$here/layers
# The run uses no caches of earlier runs and leaves none. Only during the run, the drivers' compiled kernels are kept in
# a temporary folder.
caches=$(mktemp -d) || exit 1
trap 'rm -rf "$caches"' EXIT
export TUMBLE_CACHE_DIR="" MESA_SHADER_CACHE_DIR=$caches __GL_SHADER_DISK_CACHE_PATH=$caches

# A manifest for a driver's library.
manifest() {
    local file=$results/driver-$(basename "$1").json
    printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s", "api_version": "1.3.0"}}\n' \
        "$1" >"$file"
    echo "$file"
}
# Loaders before 1.3.207 know only the older name, VK_ICD_FILENAMES.
use() { export VK_DRIVER_FILES=$1 VK_ICD_FILENAMES=$1; }
sees_devices() { timeout -k 5 "$devices_limit" ./tumble devices 2>/dev/null | grep -q '^0  '; }

# Containers often have NVIDIA's library but no manifest. Without X, only the library for EGL can be loaded.
find_nvidia() {
    local folder library
    for library in libGLX_nvidia.so.0 libEGL_nvidia.so.0; do
        for folder in /usr/lib/x86_64-linux-gnu /usr/lib/aarch64-linux-gnu /usr/lib64 /usr/lib \
            /usr/lib/x86_64-linux-gnu/nvidia/current /usr/local/nvidia/lib64 /usr/local/lib \
            /run/opengl-driver/lib /usr/lib/wsl/lib; do
            [ -e "$folder/$library" ] || continue
            use "$(manifest "$folder/$library")"
            sees_devices && return 0
        done
    done
    unset VK_DRIVER_FILES VK_ICD_FILENAMES
    return 1
}
manifests() {
    ls /etc/vulkan/icd.d/*.json /usr/share/vulkan/icd.d/*.json /usr/local/etc/vulkan/icd.d/*.json \
        /usr/local/share/vulkan/icd.d/*.json 2>/dev/null
}
if [ -n "$driver" ]; then
    case "$driver" in
    *.json) use "$driver" ;;
    *) use "$(manifest "$driver")" ;;
    esac
    chosen="the driver that was named: $driver"
elif [ -n "${VK_DRIVER_FILES:-}" ]; then
    chosen="VK_DRIVER_FILES=$VK_DRIVER_FILES"
elif manifests | grep -qi nvidia || [ ! -e /dev/nvidiactl ] && [ -n "$(manifests)" ]; then
    chosen="the manifests of this system: $(manifests | tr '\n' ' ')"
elif find_nvidia; then
    chosen="NVIDIA's library without a manifest: $VK_DRIVER_FILES"
else
    chosen="no driver was found: $(manifests | tr '\n' ' ')"
    [ ! -e /dev/nvidiactl ] ||
        chosen="$chosen(there is /dev/nvidiactl: a container needs NVIDIA's \`graphics\` capability)"
fi

say "tumble on $(uname -n), $(date -u '+%Y-%m-%d %H:%M:%S') UTC"
say "$(cat VERSION | tr '\n' ';')"
say "$loader; $chosen"
{
    uname -a
    cat /etc/os-release 2>/dev/null
    ldd --version 2>&1 | head -1
    nproc
    grep -m1 'model name' /proc/cpuinfo
    free -m 2>/dev/null
    ls -l /dev/nvidia* /dev/dri 2>/dev/null
    manifests
    command -v nvidia-smi >/dev/null && timeout 20 nvidia-smi -q
} >"$results/environment.txt" 2>&1

# Runs a step; the arguments are its name, its time limit and the command. The output is written into files, the outcome
# into the summary.
worst=0
step() {
    local name=$1 limit=$2 started=$SECONDS code=0 outcome
    shift 2
    timeout -k 5 "$limit" "$@" >"$results/$name.txt" 2>"$results/$name.log" || code=$?
    case $code in
    0) outcome="done" ;;
    124 | 137) outcome="ENDED after $limit s" ;;
    *) outcome="exit code $code" ;;
    esac
    say "$(printf '%-16s %4d s  %s' "$name" $((SECONDS - started)) "$outcome")"
    [ "$code" -eq 0 ] || sed 's/^/                  /' "$results/$name.log" | tail -3 | tee -a "$summary"
    [ "$code" -le "$worst" ] || worst=$code
}
say ""
step devices "$devices_limit" ./tumble devices
step prove "$prove_limit" ./tumble prove "${device[@]}" --time-limit "$prove_seconds" -o "$results/proof.json"
step prove-validate "$validate_limit" \
    ./tumble prove "${device[@]}" --time-limit "$validate_seconds" --validate -o "$results/proof-validated.json"
proved=$worst
# Variants of the kernels; then a proof and a timing with the variants that the lab chose.
step lab "$lab_limit" ./tumble lab "${device[@]}" --time-limit "$lab_seconds" -o "$results/lab.json"
step prove-lab "$chosen_limit" ./tumble prove "${device[@]}" --quick --time-limit "$chosen_seconds" \
    --lab "$results/lab.json" -o "$results/proof-lab.json"
step bench "$bench_limit" ./tumble bench sparse --rounds 3 --json
say ""
for page in devices prove prove-validate lab prove-lab; do
    say "--- $page"
    say "$(cat "$results/$page.txt")"
done
tar --create --gzip --directory "$(dirname "$results")" --file "$results.tar.gz" "$(basename "$results")" \
    2>/dev/null && echo "all of it: $results.tar.gz"
echo "the summary: $summary"
# The exit code is that of the proofs; later steps only measure speed.
exit "$proved"
