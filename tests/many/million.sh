#!/bin/bash
# Makes a data set of a million slides, or so many, with GNU parallel: million.sh FOLDER [SLIDES]
# Prints its time, the time of processors, and its size.
set -euo pipefail
folder=$1 slides=${2:-1000000} wstac=${WSTAC:-wstac}
if ! [[ $slides =~ ^[1-9][0-9]*0$ ]]; then
    echo "million.sh: slides is \"$slides\", expected a multiple of 10" >&2
    exit 2
fi
mkdir -p "$folder"
cat > "$folder/sweep.toml" << END
slides = $((slides / 10)) # of each of ten specimens
speeds = [50, 75, 100, 125, 150, 175, 200, 225, 250, 275, 300]
directions = [0, 45, 90, 135, 180, 225, 270, 315]
END
# A shard has 10,000 slides at most: a job that is lost costs less than a minute.
shards=$(((slides + 9999) / 10000))
[ "$shards" -ge 4 ] || shards=4
TIMEFORMAT='%R %U %S'
{ time "$(dirname "$0")/parallel.sh" "$folder" "$shards" "$wstac" dataset "$folder/sweep.toml" 2> "$folder/said"; } \
    2> "$folder/made" || { cat "$folder/said" >&2; exit 1; }
{ time "$wstac" dataset merge "$folder"/*.shard -o "$folder/set.npz" 2> "$folder/said"; } \
    2> "$folder/merged" || { cat "$folder/said" >&2; exit 1; }
read -r real user kernel < "$folder/made"
echo "$slides slides in $shards shards: $real s, $user s and $kernel s of processors"
read -r real user kernel < "$folder/merged"
shards=$(du -bc "$folder"/*.shard | tail -n 1 | cut -f1) set=$(stat -c %s "$folder/set.npz")
echo "merged: $real s, $user s and $kernel s of processors; $shards bytes of shards, $set bytes of set"
