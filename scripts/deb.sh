#!/usr/bin/env bash
# A Debian package of the program, in target/deb: the program, its manual pages, completions and licences.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
architecture=$(dpkg --print-architecture)
cargo build --release -p tumble-cli --bin tumble
program=$target/release/tumble
package=tumble_${version}_$architecture
root=$target/deb/$package
rm -rf "$root"
mkdir -p "$root"/DEBIAN "$root"/usr/{bin,share/{man/man1,doc/tumble,bash-completion/completions,zsh/vendor-completions,fish/vendor_completions.d}}
install -m 755 "$program" "$root/usr/bin/tumble"
"$program" man | gzip -9n >"$root/usr/share/man/man1/tumble.1.gz"
for command in $("$program" help | sed -n '/^Commands:/,/^$/s/^  \([a-z]\+\) .*/\1/p' | grep -vx help); do
    "$program" man "$command" | gzip -9n >"$root/usr/share/man/man1/tumble-$command.1.gz"
done
"$program" completions bash >"$root/usr/share/bash-completion/completions/tumble"
"$program" completions zsh >"$root/usr/share/zsh/vendor-completions/_tumble"
"$program" completions fish >"$root/usr/share/fish/vendor_completions.d/tumble.fish"
{
    echo "Tumble $version: MIT or Apache-2.0, at your choice."
    echo
    cat LICENSE-MIT LICENSE-APACHE
} >"$root/usr/share/doc/tumble/copyright"
gzip -9nc CHANGELOG.md >"$root/usr/share/doc/tumble/changelog.gz"
# The oldest version of the C library that has all symbols that the program needs.
glibc=$(objdump -T "$program" | grep -o 'GLIBC_[0-9.]*' | sed 's/GLIBC_//' | sort -uV | tail -n 1)
cat >"$root/DEBIAN/control" <<END
Package: tumble
Version: $version
Architecture: $architecture
Maintainer: The Tumble authors <noreply@example.org>
Section: graphics
Priority: optional
Installed-Size: $(du -sk "$root/usr" | cut -f 1)
Depends: libc6 (>= $glibc), libgcc-s1
Recommends: libvulkan1
Suggests: mesa-vulkan-drivers
Description: interpolates keyframe tracks of rotations in bulk
 Slerp and quaternion splines for every track at every frame, on Vulkan or the
 CPU, with the same bits: glTF, BVH, FBX, AMASS, trajectories, logs of robots.
END
dpkg-deb --root-owner-group --build "$root" "$target/deb/$package.deb"
(cd "$target/deb" && sha256sum "$package.deb" | tee "$package.deb.sha256")
