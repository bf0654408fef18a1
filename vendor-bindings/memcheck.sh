#!/bin/sh
# Runs the tests of embree-sys under valgrind: no invalid access, no use of undefined memory, no leak, in
# our code or in Embree's on our behalf. Needs valgrind (Debian: valgrind) and an installed Embree.
#
#   vendor-bindings/memcheck.sh [ARGUMENTS OF cargo test]
#
# Leaks count where memory is definitely lost: Embree's threading library keeps some on purpose.
set -eu
cd "$(dirname -- "$0")"
command -v valgrind >/dev/null || {
    echo "SKIPPED: memory check of embree-sys: no valgrind" >&2
    exit 77
}
CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUNNER="valgrind --quiet --error-exitcode=9 --leak-check=full \
--errors-for-leak-kinds=definite --show-leak-kinds=definite"
REQUIRE_EMBREE=${REQUIRE_EMBREE:-1}
export CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUNNER REQUIRE_EMBREE
exec cargo test -p embree-sys --lib --tests "$@"
