#!/bin/sh
# Proves under load, faults and abuse what the service promises, and prints a figure for each promise.
# Usage: run.sh BIN [full]; BIN is where the build put its binaries. `full` takes the whole figures and, with
# BINPOSE_SOAK_MINUTES (default 30), the soak; without it a minute or two will do.
set -eu
BINPOSE_BIN="$(cd "$1" && pwd)"
export BINPOSE_BIN
export BINPOSE_STRESS="${2:-short}"
# Debian's own Python, because Debian's gRPC belongs to it.
exec /usr/bin/python3 "$(dirname "$0")/stress_test.py"
