#!/bin/sh
# Fuzzes from the committed corpus, as many targets at once as there are cores; what is found anew stays in the build
# folder. Ends with an error on a crash, a hang or a leak. An input that once broke something belongs into the corpus.
# Usage: run.sh [SECONDS for each target, default 60 [TARGET, which stands built, default all]]
set -eu
cd "$(dirname "$0")/../.."
seconds="${1:-60}"
target="${2:-}"
if [ -z "$target" ]; then
  cmake --workflow --preset fuzz
  find tests/fuzz/corpus -mindepth 1 -type d -printf '%f\n' | xargs -P "$(nproc)" -n 1 "$0" "$seconds"
  exit
fi

found=build/fuzz/found/$target
mkdir -p "$found"
# What names the lines of a stack: binutils' comes with every compiler, LLVM's does not.
ASAN_OPTIONS=print_legend=0:external_symbolizer_path=$(command -v addr2line)
export ASAN_OPTIONS UBSAN_OPTIONS=print_stacktrace=1
if ! "build/fuzz/bin/fuzz_$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=65536 \
    -print_final_stats=1 -artifact_prefix="$found." "$found" "tests/fuzz/corpus/$target" 2>"$found.log"; then
  tail -80 "$found.log"
  input=$(sed -n 's/.*Test unit written to //p' "$found.log")
  echo "$target FAILED; to see it again: build/fuzz/bin/fuzz_$target $input"
  exit 1
fi
echo "$target, $seconds s: $(sed -n 's/stat::number_of_executed_units: *//p' "$found.log") inputs, nothing found"
