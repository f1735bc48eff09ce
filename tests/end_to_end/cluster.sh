#!/bin/sh
# Proves that three servers on one model directory behind HAProxy are one service, and prints a figure for each promise.
# Usage: cluster.sh BIN [short|full [TEST...]]; BIN is where the build put its binaries. Each server and the balancer is a
# host of its own where network namespaces can be made, else an address on loopback. Exits with 77 without HAProxy.
set -eu
BINPOSE_BIN="$(cd "$1" && pwd)"
export BINPOSE_BIN
export BINPOSE_CLUSTER="${2:-short}"
PATH="$PATH:/usr/sbin"
if ! command -v haproxy >/dev/null; then
  echo "Skipped: haproxy is not installed; deploy/install-packages.sh test installs it."
  exit 77
fi
shift
if [ $# -gt 0 ]; then shift; fi
set -- /usr/bin/python3 "$(dirname "$0")/cluster_test.py" "$@"
private() { unshare --net --mount --pid --fork --kill-child --mount-proc "$@"; }
if command -v ip >/dev/null && private sh -c 'mkdir -p /run/netns && mount -t tmpfs tmpfs /run/netns && ip netns add a' \
    >/dev/null 2>&1; then
  # Namespaces within namespaces: all goes when the test ends, however it does.
  export BINPOSE_CLUSTER_HOSTS=namespaces
  # shellcheck disable=SC2016  # for the inner shell
  private sh -c 'mount -t tmpfs tmpfs /run/netns && ip link set lo up && exec "$@"' sh "$@"
else
  echo "No network namespaces can be made here: each host is an address on loopback."
  export BINPOSE_CLUSTER_HOSTS=loopback
  exec "$@"
fi
