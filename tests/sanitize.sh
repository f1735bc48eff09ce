#!/bin/sh
# Builds with sanitizers and runs what they can judge: addresses and undefined behaviour over every C++ test, threads
# over core, the compute pool and the model store (gRPC is not built for the thread sanitizer, so it sees races that are
# none). Nightly: the two builds take half an hour on two cores.
# Usage: sanitize.sh [asan] [tsan], default both
set -eu
cd "$(dirname "$0")/.."

run_tests() {
  preset="$1"
  shift
  for test in "$@"; do
    echo "== $preset $test"
    "build/$preset/bin/$test" --gtest_brief=1
  done
}

[ $# -gt 0 ] || set -- asan tsan
for preset in "$@"; do
  cmake --preset "$preset" >/dev/null
  case "$preset" in
    asan)
      cmake --build build/asan
      # PCL's allocations, which one test compares ours with, do not fit the sanitizer's idea of new and delete.
      export ASAN_OPTIONS=alloc_dealloc_mismatch=0:detect_stack_use_after_return=1
      export LSAN_OPTIONS=suppressions=tests/sanitize_suppressions.txt
      # shellcheck disable=SC2046  # names of tests have no spaces
      run_tests asan $(cd build/asan/bin && ls -- *_test)
      ;;
    tsan)
      tests="geometry_test train_test detect_test matching_tables_test"
      # shellcheck disable=SC2086
      cmake --build build/tsan --target $tests server_parts_test
      export TSAN_OPTIONS=halt_on_error=1
      # shellcheck disable=SC2086
      run_tests tsan $tests
      GTEST_FILTER="ComputePool*:ModelStore*" run_tests tsan server_parts_test
      ;;
  esac
done
