#!/bin/sh
# Fuzzes each target from its corpus; what it finds anew stays in the build folder. Ends with an error on a crash, a hang
# or a leak. An input that once broke something belongs into the corpus, which every run of the tests reads.
# Usage: run.sh [SECONDS for each target, default 60; by night 3600]
set -eu
cd "$(dirname "$0")/../.."
seconds="${1:-60}"
build=build/fuzz
deploy/install-packages.sh fuzz
cmake --preset fuzz >/dev/null
cmake --build "$build" --target fuzz_mesh fuzz_cloud fuzz_model_file fuzz_request
for target in mesh cloud model_file request; do
  mkdir -p "$build/found/$target"
  echo "== $target, $seconds s"
  "$build/bin/fuzz_$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=65536 -print_final_stats=1 \
      -artifact_prefix="$build/found/" "$build/found/$target" "tests/fuzz/corpus/$target" 2>"$build/found/$target.log" ||
    { tail -40 "$build/found/$target.log"; exit 1; }
  grep -E "number_of_executed_units|average_exec_per_sec" "$build/found/$target.log"
done
