#!/bin/sh
# Proves under load, faults and abuse what the service promises, and prints a figure for each promise.
# Usage: run.sh BIN [full|nightly]; BIN is where the build put its binaries. `full` takes the whole figures and a soak of
# three minutes, `nightly` one of thirty (or BINPOSE_SOAK_MINUTES); without either a minute or two will do.
set -eu
BINPOSE_BIN="$(cd "$1" && pwd)"
export BINPOSE_BIN
export BINPOSE_STRESS="${2:-short}"
if [ "$BINPOSE_STRESS" = nightly ]; then
  export BINPOSE_STRESS=full BINPOSE_SOAK_MINUTES="${BINPOSE_SOAK_MINUTES:-30}"
fi
# Debian's own Python, because Debian's gRPC belongs to it.
exec /usr/bin/python3 "$(dirname "$0")/stress_test.py"
