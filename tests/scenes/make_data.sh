#!/bin/sh
# Makes tests/data/scenes anew, to the same bytes. Usage: make_data.sh BUILD_DIRECTORY (configured with BINPOSE_SCENES)
set -eu
make_scene=$(realpath "$1")/bin/binpose-make-scene
cd "$(dirname "$0")/../data"
for scene in bearing_support_01 bearing_support_02 bearing_support_03 spindle_01 lock_plate_01; do
  "$make_scene" "parts/${scene%_*}.stl" "scenes/$scene" --seed "${scene##*_0}"
done
"$make_scene" parts/bearing_support.stl scenes/empty_bin_01 --count 0
