#!/bin/sh
# Installs the Debian 12 packages that are missing, and nothing when none is. The one list of what binpose needs.
# Usage: install-packages.sh run|build|test
set -eu

run="libabsl20220623 libcivetweb1 libgrpc++1.51 liblzf1 libpng16-16 libprometheus-cpp-core1.0
  libprotobuf32 libspdlog1.10 libssl3 libtbb12"
build="cmake g++ ninja-build
  libabsl-dev libcivetweb-dev libcli11-dev libeigen3-dev libgrpc++-dev liblzf-dev libpng-dev libprotobuf-dev libspdlog-dev
  libssl-dev libtbb-dev prometheus-cpp-dev protobuf-compiler protobuf-compiler-grpc"
test="chromium chromium-driver clang clang-format clang-tidy curl docker-compose fish git haproxy iproute2 libbenchmark-dev
  libbullet-dev libclang-rt-14-dev libembree-dev libgmock-dev libgtest-dev libpcl-dev nlohmann-json3-dev openssl
  pkgconf prometheus python3 python3-grpcio python3-matplotlib python3-numpy python3-pil python3-protobuf
  python3-selenium python3-setuptools python3-yaml shellcheck systemd zsh"
# Node.js from elsewhere brings its own npm and conflicts with Debian's.
command -v npm >/dev/null || build="$build npm ca-certificates"
case "${1:-}" in
  run) packages=$run ;;
  build) packages=$build ;;
  test) packages="$build $test" ;;
  *)
    echo "Usage: $0 run|build|test" >&2
    exit 2
    ;;
esac

missing=""
for package in $packages; do
  dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

sudo=""
if [ "$(id -u)" != 0 ]; then
  command -v sudo >/dev/null || { echo "Missing:$missing. Install them as root, or install sudo." >&2; exit 1; }
  sudo="sudo"
fi

echo "Installing$missing"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# shellcheck disable=SC2086  # words on purpose
if ! { $sudo apt-get update && $sudo env DEBIAN_FRONTEND=noninteractive \
       apt-get install -y --no-install-recommends $missing; } >"$log" 2>&1; then
  cat "$log" >&2
  echo "apt-get could not install:$missing" >&2
  exit 1
fi
