#!/bin/sh
# Runs the tests against Debian 13's Embree 4, on any amd64 Debian.
#
#   tests/debian13.sh [ARGUMENTS OF cargo test]           default: --workspace
#   tests/debian13.sh --as-built [ARGUMENTS OF cargo test]
#   tests/debian13.sh --headers                           print the folder of Debian 13's Embree headers
#
# Debian 13's Embree, its threading library and the C and C++ libraries that they need are unpacked
# (60 MB, not installed) into target/debian13-root, or the folder that DEBIAN13_ROOT names, which is
# reused by later runs. The tests are then built to start with that C library, so that they, and the
# programs that they start, load Embree 4 although this system has none, or another one. That takes a target
# folder of its own. With --as-built they are those of an ordinary cargo test, started by Debian 13's loader: no
# time for building, but programs that a test starts load this system's Embree.
#
# Ends with 77, and a line that says why, where that is impossible on this machine.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
root=${DEBIAN13_ROOT:-$here/target/debian13-root}
packages="libembree4-4 libembree-dev libtbb12 libtbbmalloc2 libtbbbind-2-5 libhwloc15 libudev1 libcap2
    libc6 libstdc++6 libgcc-s1"

skip() {
    echo "SKIPPED: the tests against Debian 13's Embree 4: $1" >&2
    exit 77
}

unpack() {
    for program in apt-get dpkg dpkg-deb; do
        command -v $program >/dev/null || skip "no $program"
    done
    [ "$(dpkg --print-architecture)" = amd64 ] || skip "this is not amd64"
    keyring=/usr/share/keyrings/debian-archive-keyring.gpg
    [ -e $keyring ] || skip "no $keyring (package debian-archive-keyring)"

    # An apt of its own: the system's sources, lists and package states are not touched.
    work=$root.new
    rm -rf "$work"
    mkdir -p "$work/apt/state/lists/partial" "$work/apt/cache/archives/partial" "$work/debs" "$work/root"
    : >"$work/apt/status"
    echo "deb [arch=amd64 signed-by=$keyring] ${DEBIAN_MIRROR:-http://deb.debian.org/debian} trixie main" \
        >"$work/apt/sources.list"
    cat >"$work/apt/apt.conf" <<CONFIGURATION
Dir::State "$work/apt/state";
Dir::State::status "$work/apt/status";
Dir::Cache "$work/apt/cache";
Dir::Etc::sourcelist "$work/apt/sources.list";
Dir::Etc::sourceparts "-";
Acquire::Languages "none";
APT::Sandbox::User "";
CONFIGURATION
    (
        cd "$work/debs"
        export APT_CONFIG="$work/apt/apt.conf"
        apt-get -qq update && apt-get -qq download $packages
    ) || skip "cannot download Debian 13's packages"
    for package in "$work/debs"/*.deb; do
        dpkg-deb -x "$package" "$work/root"
    done
    rm -rf "$root"
    mv "$work/root" "$root"
    rm -rf "$work"
}

[ -e "$root/usr/lib/x86_64-linux-gnu/libembree4.so.4" ] || unpack >&2
if [ "${1:-}" = --headers ]; then
    echo "$root/usr/include/embree4"
    exit
fi

libraries=$root/usr/lib/x86_64-linux-gnu
[ "$("$libraries/ld-linux-x86-64.so.2" --library-path "$libraries" /bin/true && echo runs)" = runs ] ||
    skip "Debian 13's C library does not run here"

REQUIRE_EMBREE=4
export REQUIRE_EMBREE
unset EMBREE_LIB
cd "$here"
report() {
    if "$@"; then
        echo "passed against Debian 13's Embree 4: $*"
    else
        echo "FAILED against Debian 13's Embree 4: $*" >&2
        exit 1
    fi
}

if [ "${1:-}" = --as-built ]; then
    shift
    CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUNNER="$libraries/ld-linux-x86-64.so.2 --library-path $libraries"
    export CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUNNER
    [ $# -gt 0 ] || set -- --workspace
    report cargo test "$@"
    exit
fi

# The explicit target keeps build scripts and procedural macros, which cargo runs, on the system's libraries.
RUSTFLAGS="-C link-arg=-Wl,--dynamic-linker=$libraries/ld-linux-x86-64.so.2 \
-C link-arg=-Wl,--disable-new-dtags,-rpath,$libraries ${RUSTFLAGS:-}"
export RUSTFLAGS
[ $# -gt 0 ] || set -- --workspace
report cargo test --target x86_64-unknown-linux-gnu --target-dir "$here/target/debian13" "$@"
