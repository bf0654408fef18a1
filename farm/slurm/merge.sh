#!/bin/sh
#SBATCH --job-name=lightmesh-merge
# Last job of submit.sh, a task per frame: its tiles become one picture.
#
#   merge.sh FOLDER TILES [FIRST]
set -eu

folder=$1
tiles=$2
name=picture
[ -z "${3:-}" ] || name=$(printf 'frame.%04d' $(($3 + SLURM_ARRAY_TASK_ID)))
# Tiles of an earlier job that shared the picture out in another way are left alone.
exec "${LIGHTMESH:-lightmesh}" merge "$folder/tiles/$name".*-of-"$tiles".exr -o "$folder/$name.exr"
