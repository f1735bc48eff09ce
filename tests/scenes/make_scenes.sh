#!/bin/sh
# Makes scenes of all four parts: 113 each, or 8 each with --small. Goes on where it was stopped.
# Usage: make_scenes.sh BUILD_DIRECTORY OUTPUT_FOLDER [--small]
set -eu
make_scene=$(realpath "$1")/bin/binpose-make-scene
mkdir -p "$2"
output=$(realpath "$2")
count=113
[ "${3:-}" != --small ] || count=8
cd "$(dirname "$0")/../data/parts"

# One line a scene that is not there yet: gt.json is written last. Seeds from 1001 on are none of tests/data's.
for k in $(seq "$count"); do
  for mesh in *.stl; do
    scene=$(printf '%s/%s_%03d' "$output" "${mesh%.stl}" "$k")
    [ -e "$scene/gt.json" ] || echo "$mesh $scene --seed $((1000 + k))"
  done
done | xargs -r -P "$(nproc)" -L 1 "$make_scene"
