#!/usr/bin/env bash
# Makes an archive in target/library with the C library for this machine's system (Linux), and a file with its SHA-256.
# The archive has headers for C and C++, the shared library with its SONAME, the static library, files for pkg-config
# and CMake, an example, the licences. It may be unpacked anywhere.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
host=$(rustc -vV | sed -n 's/^host: //p')
# Before 1.0 a minor version may change the interface: 0.1.2 has the SONAME libtumble.so.0.1.
so=$(echo "$version" | sed -E 's/^(0\.[0-9]+).*/\1/; t; s/^([0-9]+).*/\1/')
name=libtumble-$version-$host
folder=$target/library/$name

cargo rustc --release -p tumble-capi --lib --crate-type cdylib -- -C "link-arg=-Wl,-soname,libtumble.so.$so"
cargo rustc --release -p tumble-capi --lib --crate-type staticlib
rm -rf "$folder"
mkdir -p "$folder/include" "$folder/lib/pkgconfig" "$folder/lib/cmake/tumble" "$folder/share/doc/tumble/examples"
cp capi/include/tumble.h capi/include/tumble.hpp "$folder/include"
cp "$target/release/libtumble_capi.so" "$folder/lib/libtumble.so.$version"
strip --strip-unneeded "$folder/lib/libtumble.so.$version"
ln -s "libtumble.so.$version" "$folder/lib/libtumble.so.$so"
ln -s "libtumble.so.$so" "$folder/lib/libtumble.so"
cp "$target/release/libtumble_capi.a" "$folder/lib/libtumble.a"
strip --strip-debug "$folder/lib/libtumble.a"
fill() { sed -e "s/@VERSION@/$version/g" -e "s/@SOVERSION@/$so/g" "packaging/$1" >"$folder/$2"; }
fill tumble.pc.in lib/pkgconfig/tumble.pc
fill tumble-config.cmake lib/cmake/tumble/tumble-config.cmake
fill tumble-config-version.cmake lib/cmake/tumble/tumble-config-version.cmake
cp README.md CHANGELOG.md LICENSE-APACHE LICENSE-MIT docs/c.md "$folder/share/doc/tumble"
cp capi/examples/* "$folder/share/doc/tumble/examples"
readelf -d "$folder/lib/libtumble.so.$version" | grep -qF "[libtumble.so.$so]"
tar -C "$target/library" -czf "$target/library/$name.tar.gz" "$name"
(cd "$target/library" && sha256sum "$name.tar.gz" | tee "$name.tar.gz.sha256")
