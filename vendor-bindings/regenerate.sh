#!/bin/sh
# Regenerates src/bindings/embree3.rs and embree4.rs from Embree's own headers.
#
#   vendor-bindings/regenerate.sh [--check] HEADER_FOLDER...
#
# A header folder is what holds rtcore.h: /usr/include/embree3 where Debian 12's libembree-dev is
# installed, DIR/usr/include/embree4 where Debian 13's is unpacked (tests/debian13.sh --headers prints
# such a folder). The version is read from the headers. With --check nothing is written, and any
# difference from the committed files fails. Needs libclang (Debian: libclang-dev).
set -eu

usage() {
    sed -n '2,10s/^# \{0,1\}//p' "$0" >&2
    exit 2
}

check=false
if [ "${1:-}" = --check ]; then
    check=true
    shift
fi
[ $# -gt 0 ] || usage

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT

for headers in "$@"; do
    cargo run --quiet --locked --manifest-path "$here/regenerate/Cargo.toml" -- "$headers" "$fresh"
done

if $check; then
    status=0
    for file in "$fresh"/*.rs; do
        name=$(basename "$file")
        if diff -u "$here/src/bindings/$name" "$file"; then
            echo "$name: as the headers say"
        else
            echo "$name differs from the headers: run vendor-bindings/regenerate.sh" >&2
            status=1
        fi
    done
    exit $status
fi
cp "$fresh"/*.rs "$here/src/bindings/"
