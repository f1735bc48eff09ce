#!/bin/sh
# The paper's experiments by one command: builds, makes the scenes of parts A-D, runs every method on them, writes the
# tables of PAPER.md and draws its pictures. Goes on where it was stopped; measures anew when the code has changed.
# Usage: paper.sh [small|full]   8 scenes of each part, a quarter of an hour on two cores; or 113, some hours
set -eu
cd "$(dirname "$0")/../.."
mode=${1:-small}
case "$mode" in
  small) count=8 ;;
  full) count=113 ;;
  *)
    echo "Usage: $0 [small|full]" >&2
    exit 2
    ;;
esac
build=build/dev
paper=$build/bin/binpose-paper
parts=tests/data/parts
scenes=$build/paper/$mode/scenes

deploy/install-packages.sh test
cmake --preset dev -DBINPOSE_BENCH=ON
cmake --build "$build" --target binpose-make-scene binpose-paper
tests/scenes/make_scenes.sh "$build" "$scenes" "$count"

results=$build/paper/$mode/$(sha256sum "$paper" | cut -c 1-12)
mkdir -p "$results"
# Two at a time, each on one thread: times count. The longest first; by thirds, so that both cores end at about once and
# each third has all four parts.
xargs -P 2 -L 1 "$paper" <<JOBS
table $parts $scenes $results/table_0.jsonl --shares 3 --share 0
table $parts $scenes $results/table_1.jsonl --shares 3 --share 1
table $parts $scenes $results/table_2.jsonl --shares 3 --share 2
sweep $parts $scenes $results/sweep_0.jsonl --shares 3 --share 0
sweep $parts $scenes $results/sweep_1.jsonl --shares 3 --share 1
sweep $parts $scenes $results/sweep_2.jsonl --shares 3 --share 2
accuracy $parts $results/accuracy.jsonl
pictures $parts $scenes $results/pictures.jsonl
JOBS

# Debian's Python, to which python3-matplotlib belongs.
/usr/bin/python3 tests/bench/paper/report.py "$results" "$scenes" tests/bench/PAPER.md
echo "Done: tests/bench/PAPER.md"
