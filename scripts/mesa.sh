#!/usr/bin/env bash
# Unpacks newer versions of Mesa for tests/mesa, in addition to the system's. Debian 12 has Mesa 22.3. Its backports
# have 25.0, whose RADV also compiles for RDNA 4. Debian 13 has NVK, which compiles for NVIDIA's cards; it is unpacked
# with all libraries that it needs, even the C library and its loader. The packages are unpacked into target/mesa and
# not installed; apt's configuration and lists do not change. If this is not possible on this system (it is not Debian
# 12, for example), target/mesa/unavailable has the reason, and the tests that need these versions compare nothing.
# MESA_SUITE=sid (or another suite of Debian) unpacks RADV of that suite too, 200 MB with its libraries, into
# target/mesa/newest.
set -euo pipefail
cd "$(dirname "$0")/.."

place=$PWD/target/mesa
keyring=/usr/share/keyrings/debian-archive-keyring.gpg
# Whether MESA_SUITE is set and its Mesa is not unpacked yet.
is_missing() { [ -n "${MESA_SUITE:-}" ] && ! [ -e "$place/newest/loader" ]; }
if [ -e "$place/complete" ] && [ -e "$place/nvk/loader" ] && ! is_missing; then
    exit 0
fi
rm -rf "$place"
mkdir -p "$place"

unavailable() {
    echo "$1" >"$place/unavailable"
    echo "no newer Mesa: $1; the tests that want it say so and compare nothing" >&2
    exit 0
}
release() { sed -n 's/^VERSION_CODENAME=//p' /etc/os-release 2>/dev/null || true; }
command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null ||
    unavailable "this system has no apt"
[ "$(release)" = bookworm ] ||
    unavailable "its packages are those of Debian 12 (bookworm-backports), and this is another system"
[ -e "$keyring" ] || unavailable "there is no $keyring"

echo "unpacking a newer Mesa into target/mesa" >&2
apt="$place/apt"
# Downloads packages into $apt, by separate lists of packages. Arguments: apt's command (`install` also downloads
# dependencies), a suite of Debian, the file with the state of installed packages, and the names of the packages.
download() {
    local command=$1 suite=$2 installed=$3
    shift 3
    rm -rf "$apt"
    mkdir -p "$apt/lists/partial" "$apt/cache/archives/partial"
    echo "deb [signed-by=$keyring] http://deb.debian.org/debian $suite main" >"$apt/sources.list"
    local private=(apt-get -qq -o Dir::Etc::SourceList="$apt/sources.list" -o Dir::Etc::SourceParts=-
        -o Dir::State="$apt" -o Dir::State::Status="$installed"
        -o Dir::Cache="$apt/cache" -o APT::Sandbox::User=root)
    "${private[@]}" update && (cd "$apt" && "${private[@]}" "$command" "$@") &&
        find "$apt/cache" -name '*.deb' -exec mv -t "$apt" {} +
}
# Extracts files from the packages in $apt. Arguments: a folder, then patterns of file names.
extract() {
    local folder=$1 package
    shift
    for package in "$apt"/*.deb; do
        dpkg-deb --fsys-tarfile "$package" | tar --extract --directory "$folder" --wildcards \
            --no-anchored --exclude '*/lib64/*' --transform 's|.*/||' "$@" 2>/dev/null || true # not every package has each
    done
}
# NVK and the libraries that it is linked to.
nvk=(mesa-vulkan-drivers mesa-drm-shim libc6 libgcc-s1 libstdc++6 libdrm2 libexpat1 zlib1g libzstd1
    libwayland-client0 libffi8 libxau6 libxdmcp6 libxcb1 libx11-xcb1 libxcb-dri3-0 libxcb-present0
    libxcb-xfixes0 libxcb-sync1 libxcb-randr0 libxcb-shm0 libxshmfence1)
mkdir "$place/nvk"
touch "$place/none"
if ! { download download bookworm-backports /var/lib/dpkg/status mesa-vulkan-drivers/bookworm-backports &&
    extract "$place" 'libvulkan_lvp.so' 'libvulkan_radeon.so' 'lvp_icd.json' 'radeon_icd.json' &&
    download download trixie "$place/none" "${nvk[@]}" &&
    extract "$place/nvk" 'nouveau_icd.json' 'libvulkan_nouveau.so' 'libnouveau_noop_drm_shim.so' 'ld-linux*' \
        'lib*.so.[0-9]*' && [ -e "$place/libvulkan_lvp.so" ] && [ -e "$place/libvulkan_radeon.so" ] &&
    [ -e "$place/nvk/libvulkan_nouveau.so" ] && [ -e "$place/nvk/libnouveau_noop_drm_shim.so" ]; }; then
    rm -rf "$place"
    echo "bookworm-backports and trixie could not be read; without them the tests of the newer Mesa say so and" >&2
    echo "compare nothing (where CI is set they fail)" >&2
    exit 0
fi
if [ -n "${MESA_SUITE:-}" ]; then
    mkdir "$place/newest"
    download install "$MESA_SUITE" "$place/none" --yes --download-only --no-install-recommends \
        mesa-vulkan-drivers mesa-drm-shim
    extract "$place/newest" 'radeon_icd.json' 'libvulkan_radeon.so' 'libamdgpu_noop_drm_shim.so' 'ld-linux*' 'libelf-*.so' \
        'lib*.so.[0-9]*'
fi
rm -rf "$apt" "$place/none" "$place"/lock*
for folder in "$place/nvk" "$place/newest"; do
    if [ -e "$folder" ]; then
        (cd "$folder" && ln -s ld-linux* loader)
    fi
done
# A library that is named without a folder is searched for among the installed ones. With `./`, the loader looks for it
# next to the manifest.
for manifest in "$place"/*_icd.json "$place"/n*/*_icd.json; do
    sed -i 's|"libvulkan_|"./libvulkan_|' "$manifest"
done
touch "$place/complete"
