#!/bin/sh
# Submits a picture, or the frames of an animation, to Slurm: bake, then tiles, then merge.
#
#   farm/slurm/submit.sh [--wait] SCENE FOLDER [TILES [FIRST-LAST]]
#
# SCENE and FOLDER lie where all nodes see them. FOLDER, made if need be, gets the light mesh, the tiles, the logs and
# at last picture.exr, or frame.0001.exr and so on. TILES (default 4) is how many jobs share each picture. With --wait
# the script ends with the last job, and with 1 if one of them failed for good. From the environment:
#
#   LIGHTMESH   the program (default: lightmesh)
#   RETRIES     how often a tile that failed is tried again (default: 2)
#   SBATCH_...  what sbatch itself reads: SBATCH_PARTITION, SBATCH_ACCOUNT, SBATCH_TIMELIMIT
set -eu

wait=
if [ "${1:-}" = --wait ]; then
    wait=--wait
    shift
fi
if [ $# -lt 2 ] || [ $# -gt 4 ]; then
    echo "usage: $0 [--wait] SCENE FOLDER [TILES [FIRST-LAST]]" >&2
    exit 2
fi
here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
scene=$(realpath -- "$1")
tiles=${3:-4}
frames=${4:-}
case $tiles in
'' | *[!0-9]* | 0*)
    echo "$0: TILES is a number from 1 up, found '$tiles'" >&2
    exit 2
    ;;
esac
first=${frames%%-*}
last=${frames##*-}
case $frames in
'') count=1 ;;
*[!0-9-]* | -* | *- | *-*-* | 0?* | *-0?*)
    echo "$0: frames are FIRST-LAST, such as 1-48, found '$frames'" >&2
    exit 2
    ;;
*)
    count=$((last - first + 1))
    if [ $count -lt 1 ]; then
        echo "$0: no frame is in '$frames'" >&2
        exit 2
    fi
    ;;
esac
mkdir -p -- "$2/tiles" "$2/logs"
folder=$(realpath -- "$2")

submit() {
    sbatch --parsable --kill-on-invalid-dep=yes "$@"
}
bake=$(submit --output="$folder/logs/bake.%j.log" "$here/bake.sh" "$scene" "$folder" $frames)
# One task per tile of each frame, tiles first: task T renders tile T % TILES + 1 of frame FIRST + T / TILES.
render=$(submit --dependency="afterok:$bake" --array="0-$((count * tiles - 1))" --requeue --open-mode=append \
    --output="$folder/logs/tile.%A_%a.log" "$here/tile.sh" "$scene" "$folder" "$tiles" "$first")
echo "bake $bake, tiles $render"
merge=$(submit $wait --dependency="afterok:$render" --array="0-$((count - 1))" \
    --output="$folder/logs/merge.%A_%a.log" "$here/merge.sh" "$folder" "$tiles" "$first") || failed=1
echo "merge $merge"
[ -n "$wait" ] || exit "${failed:-0}"
# sbatch takes it for no failure that a job never ran since one that it depends on failed.
states=$(scontrol show job "$merge" | sed -n 's/.*JobState=\([A-Z_]*\).*/\1/p' | sort -u)
if [ -n "${failed:-}" ] || [ "$states" != COMPLETED ]; then
    echo "$0: not finished; $folder/logs says why" >&2
    exit 1
fi
