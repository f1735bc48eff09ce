#!/bin/sh
# Installs what is missing, builds, and runs every test and lint; what stands from an earlier run is kept.
# Usage: run.sh [ctest options], for example: run.sh -R Detect
set -eu
cd "$(dirname "$0")/.."
build=build/dev

deploy/install-packages.sh test

cmake --preset dev
cmake --build "$build"

# The linter of the wire API and the schemas of Kubernetes and Grafana are npm packages; where npm cannot fetch them, their tests are
# skipped and say so.
if ! cmp -s tests/lint/package.json "$build/package.json"; then
  cp tests/lint/package.json "$build/"
  npm install --prefix "$build" --no-package-lock --ignore-scripts --no-audit --no-fund --loglevel=error \
      --fetch-retries=1 --fetch-retry-mintimeout=1000 || rm "$build/package.json"
fi

# One more than there are cores, as some tests mostly wait.
exec ctest --test-dir "$build" --output-on-failure --parallel "$(($(nproc) + 1))" "$@"
