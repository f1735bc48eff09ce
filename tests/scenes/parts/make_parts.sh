#!/bin/sh
# Makes the STL files of the parts (binary, millimetres) from their sources here. Needs Debian's openscad.
set -eu
cd "$(dirname "$0")"
for source in *.scad; do
  openscad -q --export-format binstl -o "../../data/parts/${source%.scad}.stl" "$source"
done
