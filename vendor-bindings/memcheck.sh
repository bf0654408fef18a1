#!/bin/sh
# Runs the tests of embree-sys under valgrind: no invalid access, no use of undefined memory, no leak, in
# our code or in Embree's on our behalf. Those that don't call Embree run under Miri too, which knows the rules of
# unsafe Rust. Needs valgrind (Debian: valgrind), an installed Embree, and Miri (rustup +nightly component add miri
# rust-src).
#
#   vendor-bindings/memcheck.sh [ARGUMENTS OF cargo test]
#
# Leaks count where memory is definitely lost: Embree's threading library keeps some on purpose. Ends with 77, and a
# line that says why, where a part was skipped.
set -eu
cd "$(dirname -- "$0")"
status=0
skip() {
    echo "SKIPPED: memory check of embree-sys: $1" >&2
    status=77
}
if command -v valgrind >/dev/null; then
    CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUNNER="valgrind --quiet --error-exitcode=9 --leak-check=full \
--errors-for-leak-kinds=definite --show-leak-kinds=definite" \
        REQUIRE_EMBREE=${REQUIRE_EMBREE:-1} cargo test -p embree-sys --lib --tests "$@"
else
    skip 'no valgrind'
fi
if cargo +nightly miri --version >/dev/null 2>&1; then
    cargo +nightly miri test -p embree-sys --lib "$@"
else
    skip 'no Miri'
fi
exit $status
