#!/bin/bash
# Makes a data set in shards with GNU parallel: parallel.sh SWEEP.toml SHARDS FOLDER [OPTION of parallel]…
# The same command again makes the shards that failed or are missing.
set -euo pipefail
export WSTAC=${WSTAC:-wstac} SWEEP=$1 SHARDS=$2 FOLDER=$3
shift 3
mkdir -p "$FOLDER"
make_shard() { "$WSTAC" dataset "$SWEEP" --shard "$1/$SHARDS" --threads 1 -o "$FOLDER/$1.shard"; }
export -f make_shard
# The job log may know a shard whose file is gone; then the merge names what is missing.
SHELL=/bin/bash parallel "$@" --joblog "$FOLDER/jobs.log" --retries 3 --resume-failed make_shard ::: $(seq "$SHARDS")
exec "$WSTAC" dataset merge "$FOLDER"/*.shard -o "$FOLDER/set.npz"
