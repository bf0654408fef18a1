#!/bin/sh
#SBATCH --job-name=lightmesh-bake
# First job of submit.sh: the light mesh of the whole scene.
#
#   bake.sh SCENE FOLDER
set -eu

export RAYON_NUM_THREADS="${SLURM_CPUS_PER_TASK:-${SLURM_CPUS_ON_NODE:-1}}"
exec "${LIGHTMESH:-lightmesh}" bake "$1" -o "$2/field.lmesh" --verbose
