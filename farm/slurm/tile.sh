#!/bin/sh
#SBATCH --job-name=lightmesh-tile
# Second job of submit.sh, a task per tile of each frame.
#
#   tile.sh SCENE FOLDER TILES [FIRST]
#
# A tile that failed is queued again, as another node may do better, RETRIES times; then, and for wrong usage at once,
# the task ends with the program's exit code, and nothing is merged.
set -eu

scene=$1
folder=$2
tiles=$3
first=${4:-}
tile=$((SLURM_ARRAY_TASK_ID % tiles + 1))
set -- render "$scene" --light-mesh "$folder/field.lmesh" --tile "$tile/$tiles" --float --verbose
if [ -n "$first" ]; then
    frame=$((first + SLURM_ARRAY_TASK_ID / tiles))
    set -- "$@" --frames "$frame-$frame" -o "$folder/tiles/frame.####.$tile-of-$tiles.exr"
else
    set -- "$@" -o "$folder/tiles/picture.$tile-of-$tiles.exr"
fi

export RAYON_NUM_THREADS="${SLURM_CPUS_PER_TASK:-${SLURM_CPUS_ON_NODE:-1}}"
code=0
"${LIGHTMESH:-lightmesh}" "$@" || code=$?
[ $code -ne 0 ] || exit 0
echo "task $SLURM_ARRAY_TASK_ID: exit code $code, after ${SLURM_RESTART_COUNT:-0} restarts" >&2
if [ $code -ne 2 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt "${RETRIES:-2}" ]; then
    # Slurm ends this script to queue it again; until it does, there is nothing to do.
    scontrol requeue "$SLURM_JOB_ID" && sleep 60
fi
exit $code
