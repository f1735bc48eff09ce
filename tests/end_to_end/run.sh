#!/bin/sh
# Proves under load, faults and abuse what the service promises, and prints a figure for each promise.
# Usage: run.sh BIN [short|full|nightly]; BIN is where the build put its binaries. `short`, the default, takes a minute
# or two. `full` takes the whole figures and a soak of three minutes, then fuzzes each target for a minute and runs the
# C++ tests under the sanitizers. `nightly` soaks for thirty minutes (or BINPOSE_SOAK_MINUTES) and fuzzes each for an hour.
set -eu
BINPOSE_BIN="$(cd "$1" && pwd)"
export BINPOSE_BIN
tests="$(cd "$(dirname "$0")/.." && pwd)"

stress() {
  # Debian's own Python, because Debian's gRPC belongs to it.
  BINPOSE_STRESS="$1" /usr/bin/python3 "$tests/end_to_end/stress_test.py"
}

case "${2:-short}" in
  short)
    stress short
    exit
    ;;
  full) fuzz_seconds=60 ;;
  nightly)
    fuzz_seconds=3600
    export BINPOSE_SOAK_MINUTES="${BINPOSE_SOAK_MINUTES:-30}"
    ;;
  *)
    echo "Usage: $0 BIN [short|full|nightly]" >&2
    exit 2
    ;;
esac

# part NAME COMMAND...: one line of the summary; the next part runs even if this one fails.
summary=""
part() {
  name="$1" result=passed start="$(date +%s)"
  shift
  "$@" || result=FAILED
  summary="$summary
$name: $result, $(($(date +%s) - start)) s"
}
part stress stress full  # first, because it measures times
part fuzz "$tests/fuzz/run.sh" "$fuzz_seconds"
part asan "$tests/sanitize.sh" asan
part tsan "$tests/sanitize.sh" tsan
echo "$summary"
case "$summary" in *FAILED*) exit 1 ;; esac
