#!/bin/bash
# Makes one shard in each task of a Slurm array: sbatch --array=1-100 slurm.sh SWEEP.toml FOLDER
# A task that was lost is started again by its number: sbatch --array=17 --export=ALL,SHARDS=100 slurm.sh …
#SBATCH --cpus-per-task=1
#SBATCH --requeue
set -euo pipefail
shards=${SHARDS:-$SLURM_ARRAY_TASK_COUNT}
exec "${WSTAC:-wstac}" dataset "$1" --shard "$SLURM_ARRAY_TASK_ID/$shards" --threads "${SLURM_CPUS_PER_TASK:-1}" \
    -o "$2/$SLURM_ARRAY_TASK_ID.shard"
