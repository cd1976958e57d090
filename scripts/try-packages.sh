#!/usr/bin/env bash
# Installs the packages that library.sh, deb.sh and wheel.sh have made into a Debian that has only its base system (by
# debootstrap, as root), and uses them as a new user would: a C++ program by CMake and by pkg-config, shared and static;
# the Debian package installed, used and removed; the wheel without a compiler. It is not part of test.sh, because it
# needs root, a mirror of Debian and some minutes.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
suite=${SUITE:-$(. /etc/os-release && echo "$VERSION_CODENAME")}
root=$(mktemp -d)
trap 'rm -rf --one-file-system "$root"' EXIT
debootstrap --variant=minbase "$suite" "$root" ${MIRROR:-} >"$target/debootstrap.log"
cp /etc/apt/sources.list.d/* "$root/etc/apt/sources.list.d/" 2>/dev/null && rm -f "$root/etc/apt/sources.list" || true
cp /etc/apt/apt.conf.d/* "$root/etc/apt/apt.conf.d/" 2>/dev/null || true
cp -r "$target"/library/*.tar.gz "$target"/deb/*.deb "$target"/wheels/*.whl data/pendulum.dat "$root/root"
inside() { chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive bash -ec "$1"; }

echo "the Debian package"
inside 'cd /root && apt-get update -qq && apt-get install -y -qq --no-install-recommends ./tumble_*.deb >/dev/null
    tumble --version && tumble eval pendulum.dat -o out.npy && test -s out.npy && test -s /usr/share/man/man1/tumble-eval.1.gz
    apt-get remove -y -qq tumble >/dev/null && test ! -e /usr/bin/tumble'

echo "the wheel, without a compiler"
inside 'apt-get install -y -qq --no-install-recommends python3-venv ca-certificates >/dev/null && ! command -v cc'
# NumPy is installed from the index that pip on this machine uses, with this machine's certificates.
certificates=etc/ssl/certs/ca-certificates.crt
if [ -e "/$certificates" ]; then cp "/$certificates" "$root/$certificates"; fi
inside 'cd /root && python3 -m venv env && env/bin/pip install --quiet --cert /etc/ssl/certs/ca-certificates.crt *.whl
    env/bin/python -c "import tumble; print(tumble.load(\"pendulum.dat\").clip.evaluate(fps=25).shape)"
    env/bin/tumble --version'

echo "the C library"
inside 'cd /root && apt-get install -y -qq --no-install-recommends g++ cmake make pkg-config >/dev/null
    mkdir -p /opt/tumble && tar -xzf libtumble-*.tar.gz -C /opt/tumble --strip-components 1
    mkdir -p app && cp /opt/tumble/share/doc/tumble/examples/poses.cpp app && cd app
    export PKG_CONFIG_PATH=/opt/tumble/lib/pkgconfig
    g++ -std=c++17 -Wall -Wextra -Werror poses.cpp $(pkg-config --cflags --libs tumble) -Wl,-rpath,/opt/tumble/lib -o by-pkg-config
    ./by-pkg-config >a.txt && cat a.txt
    cat >CMakeLists.txt <<END
cmake_minimum_required(VERSION 3.16)
project(app CXX)
set(CMAKE_CXX_STANDARD 17)
find_package(tumble 0.1 REQUIRED)
add_executable(shared poses.cpp)
target_link_libraries(shared tumble::tumble)
add_executable(static poses.cpp)
target_link_libraries(static tumble::tumble_static)
END
    cmake -S . -B build -DCMAKE_PREFIX_PATH=/opt/tumble >/dev/null && cmake --build build >/dev/null
    build/shared | cmp - a.txt && build/static | cmp - a.txt && ldd build/shared | grep -F libtumble.so.'
echo "all of them work"
