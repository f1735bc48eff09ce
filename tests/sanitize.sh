#!/bin/sh
# Builds with sanitizers and runs what they can judge: addresses and undefined behaviour over every C++ test, threads
# over the tests of core that start some, the compute pool, the model store and its guard (gRPC is not built for the
# thread sanitizer, so it sees races that are none). Nightly: the two builds take half an hour on two cores.
# Usage: sanitize.sh [asan] [tsan], default both
set -eu
cd "$(dirname "$0")/.."

# run_tests PRESET TEST...: each in as many shards as there are cores. Shows what a failed shard printed, and goes on
# with the others.
run_tests() {
  preset="$1"
  shift
  GTEST_TOTAL_SHARDS="$(nproc)"
  export GTEST_TOTAL_SHARDS
  # shellcheck disable=SC2016  # the inner shell expands them
  for test in "$@"; do
    seq -f "build/$preset/bin/$test %g" 0 $((GTEST_TOTAL_SHARDS - 1))
  done | xargs -P "$GTEST_TOTAL_SHARDS" -L 1 sh -c '
    if output=$(GTEST_SHARD_INDEX=$1 "$0" 2>&1); then
      echo "passed: $0, shard $1"
    else
      printf "%s\nFAILED: %s, shard %s\n" "$output" "$0" "$1"
      exit 1
    fi'
}

[ $# -gt 0 ] || set -- asan tsan
failed=""
for preset in "$@"; do
  cmake --preset "$preset" >/dev/null
  case "$preset" in
    asan)
      cmake --build build/asan
      # PCL's allocations, which one test compares ours with, do not fit the sanitizer's idea of new and delete.
      export ASAN_OPTIONS=alloc_dealloc_mismatch=0:detect_stack_use_after_return=1
      export LSAN_OPTIONS=suppressions=tests/sanitize_suppressions.txt
      # shellcheck disable=SC2046  # names of tests have no spaces
      run_tests asan $(cd build/asan/bin && ls -- *_test) || failed=yes
      ;;
    tsan)
      cmake --build build/tsan --target core_test server_parts_test
      # PCL brings a library for cameras that unlocks, when a program ends, what it never locked.
      echo "mutex:libOpenNI2" >build/tsan/suppressions
      export TSAN_OPTIONS="halt_on_error=1:suppressions=$PWD/build/tsan/suppressions"
      # By their names; the others work on one thread, where nothing can race.
      GTEST_FILTER="*Threads*:*Cancel*:*Stopped*:*Deadline*" run_tests tsan core_test || failed=yes
      GTEST_FILTER="ComputePool*:HangGuard*:ModelStore*" run_tests tsan server_parts_test || failed=yes
      ;;
  esac
done
[ -z "$failed" ]
