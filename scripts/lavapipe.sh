#!/usr/bin/env bash
# Installs lavapipe, Mesa's Vulkan driver that computes on the CPU (Debian, Ubuntu), and prints the path of its
# manifest. If `VK_DRIVER_FILES` is this path, the loader loads no other driver. In GitHub's actions, the variable is
# set for the following steps.
set -euo pipefail

manifest() {
    for path in /usr/share/vulkan/icd.d/lvp_icd*.json /usr/local/share/vulkan/icd.d/lvp_icd*.json; do
        [ -e "$path" ] && echo "$path" && return
    done
    return 1
}
has_loader() { PATH=$PATH:/sbin ldconfig -p 2>/dev/null | grep -q 'libvulkan\.so\.1'; }

if ! { manifest >/dev/null && has_loader; }; then
    command -v apt-get >/dev/null || {
        echo "this installs lavapipe by apt; on your system install Mesa's Vulkan drivers and the loader" >&2
        exit 1
    }
    sudo=""
    [ "$(id -u)" -eq 0 ] || sudo=sudo
    $sudo apt-get update -qq
    DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends \
        mesa-vulkan-drivers libvulkan1 >/dev/null
fi
found=$(manifest) || {
    echo "mesa-vulkan-drivers is installed, and there is no lvp_icd*.json in /usr/share/vulkan/icd.d" >&2
    exit 1
}
version=$(dpkg-query -W -f '${Version}' mesa-vulkan-drivers 2>/dev/null || echo "of unknown version")
echo "lavapipe: $found (mesa-vulkan-drivers $version)" >&2
[ -z "${GITHUB_ENV:-}" ] || echo "VK_DRIVER_FILES=$found" >>"$GITHUB_ENV"
echo "$found"
