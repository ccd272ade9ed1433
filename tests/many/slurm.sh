#!/bin/bash
# Makes one shard in each task of a Slurm array: sbatch --array=1-100 slurm.sh FOLDER COMMAND…
# COMMAND is that of one process without its output, such as: wstac dataset sweep.toml
# A task that was lost is started again by its number:
# sbatch --array=17 --export=ALL,SHARDS=100 slurm.sh FOLDER COMMAND…
#SBATCH --cpus-per-task=1
#SBATCH --requeue
set -euo pipefail
shards=${SHARDS:-$SLURM_ARRAY_TASK_COUNT} folder=$1
shift
export RAYON_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1}
exec "$@" --shard "$SLURM_ARRAY_TASK_ID/$shards" -o "$folder/$SLURM_ARRAY_TASK_ID.shard"
