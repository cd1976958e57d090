#!/usr/bin/env bash
# Makes target/card/tumble-card.tar.xz, an archive that proves a card on a machine with Debian or Ubuntu (or another
# system with the same or a newer glibc). The machine needs the card's driver, and no network:
#
#   tar xf tumble-card.tar.xz && tumble-card/run.sh
#
# In it are the program (the release build), Debian's Vulkan loader and validation layer, unpacked from
# their packages, and scripts/card/run.sh, which finds the driver and runs everything with time limits.
#
#   scripts/card.sh             builds it
#   scripts/card.sh --try       and tries it in a bare Debian, with lavapipe for a card (as root; debootstrap)
#   CARD_PROGRAM=path …         takes that program instead of building one
set -euo pipefail
cd "$(dirname "$0")/.."

LARGEST=$((60 * 1000 * 1000))
place=$PWD/target/card
card=$place/tumble-card

fail() {
    echo "scripts/card.sh: $1" >&2
    exit 1
}
for tool in apt-get dpkg-deb tar xz; do
    command -v "$tool" >/dev/null || fail "this needs $tool; it runs on Debian and Ubuntu"
done

build() {
    local commit
    commit=$(git rev-parse HEAD 2>/dev/null || echo unknown)
    [ "$commit" = unknown ] || git diff --quiet HEAD -- || commit="$commit, changed"
    if [ -n "${CARD_PROGRAM:-}" ]; then
        program=$CARD_PROGRAM
    else
        TUMBLE_COMMIT=$commit cargo build --quiet --release --package tumble-cli --bin tumble
        program=target/release/tumble
    fi
    rm -rf "$card"
    mkdir -p "$card/lib" "$card/layers" "$card/licences" "$place/packages"
    install -m 755 "$program" "$card/tumble"
    install -m 755 scripts/card/run.sh "$card/run.sh"
    cp LICENSE-MIT LICENSE-APACHE "$card/licences/"

    local package
    for package in libvulkan1 vulkan-validationlayers; do
        compgen -G "$place/packages/${package}_*.deb" >/dev/null ||
            (cd "$place/packages" && apt-get -qq -o APT::Sandbox::User=root download "$package") ||
            fail "$package could not be downloaded; run apt-get update first"
        rm -rf "$place/unpacked"
        dpkg-deb --extract "$place/packages/${package}"_*.deb "$place/unpacked"
        # The names are links. The files to which they lead are copied under the names of the links.
        local library
        for library in libvulkan.so.1 libVkLayer_khronos_validation.so; do
            find "$place/unpacked" -name "$library" -exec cp --dereference {} "$card/lib/" \;
        done
        find "$place/unpacked" -name VkLayer_khronos_validation.json \
            -exec sed 's|"library_path": *"[^"]*"|"library_path": "../lib/libVkLayer_khronos_validation.so"|' {} \; \
            >>"$card/layers/VkLayer_khronos_validation.json"
        cp "$place/unpacked/usr/share/doc/$package/copyright" "$card/licences/$package"
    done
    rm -rf "$place/unpacked"
    [ -e "$card/lib/libvulkan.so.1" ] && [ -e "$card/lib/libVkLayer_khronos_validation.so" ] ||
        fail "the packages have other files than were expected"

    # The newest version of glibc whose symbols the program or a library in the archive needs.
    local newest=unknown
    if command -v objdump >/dev/null; then
        newest=$(objdump -T "$card/tumble" "$card"/lib/*.so* 2>/dev/null |
            grep -o 'GLIBC_[0-9.]*' | sort -uV | tail -1 | cut -d_ -f2)
    fi
    {
        echo "tumble, commit $commit"
        echo "glibc $newest or newer"
    } >"$card/VERSION"
    local archive=$place/tumble-card.tar.xz
    tar --create --directory "$place" --owner 0 --group 0 tumble-card | xz -T0 -2 >"$archive"
    local bytes
    bytes=$(stat -c %s "$archive")
    [ "$bytes" -lt "$LARGEST" ] || fail "$archive has $bytes bytes, $LARGEST are allowed"
    echo "$archive: $bytes bytes; it wants glibc $newest or newer"
}

# Runs the archive in a Debian that has only the base system, and lavapipe instead of a card.
try() {
    [ "$(id -u)" -eq 0 ] || fail "--try makes a system of its own, for which it must be root"
    command -v debootstrap >/dev/null || fail "--try needs debootstrap"
    local root=$place/bare mirror=${CARD_MIRROR:-http://deb.debian.org/debian}
    if [ ! -e "$root/complete" ]; then
        rm -rf "$root"
        debootstrap --variant=minbase bookworm "$root" "$mirror" >"$place/debootstrap.log" 2>&1 ||
            fail "debootstrap failed: see $place/debootstrap.log"
        # The settings of this system for names and proxies, which apt needs.
        cp /etc/resolv.conf "$root/etc/" 2>/dev/null || true
        cp /etc/apt/apt.conf.d/*proxy* "$root/etc/apt/apt.conf.d/" 2>/dev/null || true
        chroot "$root" apt-get -qq update
        DEBIAN_FRONTEND=noninteractive chroot "$root" \
            apt-get -qq install --yes --no-install-recommends mesa-vulkan-drivers >/dev/null
        # Remove Debian's loader, so that the archive's loader is used.
        chroot "$root" dpkg --force-depends --purge libvulkan1 >/dev/null 2>&1 || true
        touch "$root/complete"
    fi
    rm -rf "$root/root/tumble-card"
    tar --extract --directory "$root/root" --file "$place/tumble-card.tar.xz"
    mkdir -p "$root/proc"
    mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
    # shellcheck disable=SC2064 # the folder is known now
    trap "umount '$root/proc' 2>/dev/null || true" EXIT
    local outcome=0
    # If namespaces are allowed, run without a network, so that the archive can download nothing.
    local alone=()
    unshare --net true 2>/dev/null && alone=(unshare --net)
    "${alone[@]}" chroot "$root" /root/tumble-card/run.sh "$@" || outcome=$?
    rm -rf "$place/tried"
    mkdir -p "$place/tried"
    cp -r "$root"/root/tumble-card/results-* "$place/tried/"
    echo "the results are in $place/tried; the exit code is $outcome"
    return "$outcome"
}

case "${1:-}" in
"") build ;;
--try)
    shift
    build
    try "$@"
    ;;
*) fail "unknown option $1; see the head of the file" ;;
esac
