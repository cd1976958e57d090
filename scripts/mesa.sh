#!/usr/bin/env bash
# A newer Mesa beside the system's, for tests/mesa: Debian 12 has Mesa 22.3, its backports have
# 25.0, whose RADV compiles for RDNA 4 too. The packages are unpacked into target/mesa and not
# installed, and apt's own configuration and lists stay as they are. Where this system has no such
# package, target/mesa/unavailable says why, and the tests compare nothing with it.
set -euo pipefail
cd "$(dirname "$0")/.."

place=$PWD/target/mesa
keyring=/usr/share/keyrings/debian-archive-keyring.gpg
[ -e "$place/complete" ] && exit 0
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
mkdir -p "$apt/lists/partial" "$apt/cache/archives/partial"
echo "deb [signed-by=$keyring] http://deb.debian.org/debian bookworm-backports main" >"$apt/sources.list"
private() {
    apt-get -qq -o Dir::Etc::SourceList="$apt/sources.list" -o Dir::Etc::SourceParts=- \
        -o Dir::State="$apt" -o Dir::State::Status=/var/lib/dpkg/status \
        -o Dir::Cache="$apt/cache" -o APT::Sandbox::User=root "$@"
}
if ! { private update &&
    (cd "$apt" && private download mesa-vulkan-drivers/bookworm-backports); }; then
    rm -rf "$place"
    echo "bookworm-backports could not be read; without it the tests of the newer Mesa say so and" >&2
    echo "compare nothing (where CI is set they fail)" >&2
    exit 0
fi
for driver in lvp radeon; do
    dpkg-deb --fsys-tarfile "$apt"/mesa-vulkan-drivers_*.deb |
        tar --extract --directory "$place" --wildcards --transform 's|.*/||' \
            "*/libvulkan_$driver.so" "*/${driver}_icd.json"
done
rm -rf "$apt"
# A name without a folder is that of an installed driver; the loader looks for others beside the
# manifest.
for driver in lvp radeon; do
    sed -i "s|\"libvulkan_$driver|\"./libvulkan_$driver|" "$place/${driver}_icd.json"
done
touch "$place/complete"
