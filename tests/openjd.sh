#!/bin/sh
# Runs farm/openjd/ with the command line of Open Job Description.
#
#   tests/openjd.sh [PROGRAM]         default: target/release/lightmesh
#
# The templates have to be valid. Then a picture is baked, rendered in tiles and merged: it has to equal that of one
# process, to the bit, although one of the tiles fails at first, which ends the run until that task is run again; its session
# reads the progress of each task.
#
# Ends with 77, and a line that says why, where that is impossible on this machine.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
what="the farm by Open Job Description"
program=${1:-$here/target/release/lightmesh}
. "$here/tests/farm.sh"
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

openjd=$python/bin/openjd
for template in picture frames; do
    "$openjd" check "$here/farm/openjd/$template.yaml"
done

prepare
mkdir "$work/job"
# run STEP [ARGUMENTS]: all tasks of a step, unless the arguments say otherwise; the steps before it have run.
run() {
    step=$1
    shift
    "$openjd" run "$here/farm/openjd/picture.yaml" --step "$step" "$@" -p "Scene=$work/scene/forest.toml" \
        -p "Folder=$work/job" -p Tiles=3 -p "Program=$flaky" >"$work/$step.log" 2>&1
}
show() {
    cat "$work/$1.log" >&2
    fail "$2"
}

# One of three tiles fails once.
flaky=$(flaky 2/3 "$work/failed")
if run Render --run-dependencies; then
    show Render "a tile failed, and the run ended as if all were well"
fi
[ -d "$work/failed" ] || show Render "no tile was to fail"
grep -q 'exited with code: 1 ' "$work/Render.log" || show Render "its exit code was not seen"
for tile in 2 3; do
    run Render --no-run-dependencies --task-param Tile=$tile || show Render "tile $tile failed again"
done
grep -q 'openjd_progress: 100' "$work/Render.log" || show Render "no progress was reported"
run Merge --no-run-dependencies || show Merge "the merge failed"
same "$work/job/picture.exr" || fail "the merged picture is another one"

# The same in one go.
rm -rf "$work/job" && mkdir "$work/job"
run Merge --run-dependencies || show Merge "the job failed"
same "$work/job/picture.exr" || fail "the merged picture of the undisturbed job is another one"
echo "passed: $what, $("$openjd" --version)"
