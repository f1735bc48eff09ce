#!/bin/sh
# Every shell script as shellcheck wants it.
cd "$(dirname "$0")/../.." || exit 1
find .ci deploy tests \( -name "*.sh" -o -path ".ci/run" \) -exec shellcheck {} +
