#!/bin/bash
# Makes all shards of a set with GNU parallel: parallel.sh FOLDER SHARDS COMMAND…
# COMMAND is that of one process without its output, such as: wstac dataset sweep.toml
# JOBS is the number of processes at a time; by default, one per processor. OPTIONS are others of parallel, such as
# --sshloginfile. The same command again makes the shards that failed or are missing.
set -euo pipefail
export FOLDER=$1 SHARDS=$2 RAYON_NUM_THREADS=${RAYON_NUM_THREADS:-1}
shift 2
mkdir -p "$FOLDER"
quoted=$(printf '%q ' "$@")
# A shard that is there and whole is not made again. So a job log is only for people, and each run has its own.
# shellcheck disable=SC2086 # no option or several
parallel --jobs "${JOBS:-100%}" --retries 3 --joblog "$FOLDER/jobs.log" ${OPTIONS:-} \
    "$quoted --shard {}/$SHARDS -o $(printf '%q' "$FOLDER")/{}.shard" ::: $(seq "$SHARDS")
