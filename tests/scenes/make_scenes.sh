#!/bin/sh
# Makes the paper's scenes of all four parts, COUNT each (113 unless told), 0.4 mm between points as the paper's scans
# have. Goes on where it was stopped, and tells of each scene when it is done.
# Usage: make_scenes.sh BUILD_DIRECTORY OUTPUT_FOLDER [COUNT]
set -eu
make_scene=$(realpath "$1")/bin/binpose-make-scene
mkdir -p "$2"
output=$(realpath "$2")
count=${3:-113}
cd "$(dirname "$0")/../data/parts"

# One line a scene that is not there yet: gt.json is written last. Seeds from 1001 on are none of tests/data's.
for k in $(seq "$count"); do
  for mesh in *.stl; do
    scene=$(printf '%s/%s_%03d' "$output" "${mesh%.stl}" "$k")
    [ -e "$scene/gt.json" ] || echo "$mesh $scene --seed $((1000 + k)) --spacing-mm 0.4"
  done
done | xargs -r -P "$(nproc)" -L 1 "$make_scene" ||
  echo "Some seeds give no sound pile, as told above: their scenes are left out." >&2
