#!/bin/sh
#SBATCH --job-name=lightmesh-bake
# First job of submit.sh: the light mesh of the scene's views, or of frames.
#
#   bake.sh SCENE FOLDER [FIRST-LAST]
set -eu

export RAYON_NUM_THREADS="${SLURM_CPUS_PER_TASK:-${SLURM_CPUS_ON_NODE:-1}}"
exec "${LIGHTMESH:-lightmesh}" bake "$1" ${3:+--frames "$3"} -o "$2/field.lmesh" --verbose
