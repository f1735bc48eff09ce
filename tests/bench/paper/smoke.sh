#!/bin/sh
# Every experiment on one small scene: does the whole chain run from scene to pictures?
# Usage: smoke.sh BUILD_DIRECTORY
set -eu
build=$(realpath "$1")
cd "$(dirname "$0")/../../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
paper=$build/bin/binpose-paper
parts=tests/data/parts
"$build/bin/binpose-make-scene" $parts/spindle.stl "$work/scenes/spindle_001" --count 4
"$paper" table $parts "$work/scenes" "$work/table.jsonl"
"$paper" sweep $parts "$work/scenes" "$work/sweep.jsonl"
"$paper" accuracy $parts "$work/accuracy.jsonl" --count 1
"$paper" pictures $parts "$work/scenes" "$work/pictures.jsonl"
cp tests/bench/PAPER.md "$work"
/usr/bin/python3 tests/bench/paper/report.py "$work" "$work/scenes" "$work/PAPER.md"
grep -q '| \*\*binpose, default\*\* | success |.*1/1' "$work/PAPER.md"
test "$(find "$work/pictures" -name '*.png' -size +2k | wc -l)" -eq 6
