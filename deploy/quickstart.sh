#!/bin/sh
# From a fresh Debian 12 to ranked poses and a picture of them: installs what is missing, builds, starts a server on a
# free port, trains the sample part, detects it in the sample scan, stops the server, and says where the picture is.
# Leaves nothing behind but packages and build/.
set -eu
cd "$(dirname "$0")/.."
bin=build/release/bin
part=bearing_support

heading() { printf '\n== %s\n' "$1"; }

work=$(mktemp -d)
server=""
finish() {
  [ -z "$server" ] || { kill "$server" && wait "$server"; } || true
  rm -rf "$work"
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# quietly COMMAND...: its output is shown only if it fails.
quietly() { "$@" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; } }

heading "Packages"
deploy/install-packages.sh build
echo "all there"

heading "Build (some minutes the first time)"
quietly cmake --preset release
# Ninja draws one line of progress on a terminal, and a wall of lines elsewhere.
if [ -t 1 ]; then cmake --build --preset release; else quietly cmake --build --preset release; fi
echo "$bin/binpose-server, $bin/binpose"

heading "Server"
mkfifo "$work/stdout"
"$bin/binpose-server" --listen 127.0.0.1:0 --metrics 127.0.0.1:0 --model-dir "$work/models" \
  >"$work/stdout" 2>"$work/server.log" &
server=$!
exec 3<"$work/stdout"  # stays open, or the server's next line would find no reader
read -r addresses <&3 || { cat "$work/server.log"; exit 1; }
echo "$addresses"
address=${addresses#listening on }
export BINPOSE_SERVER="${address%%,*}"

heading "Train $part"
"$bin/binpose" train --id $part --mesh tests/data/parts/$part.stl --unit mm

heading "Detect"
scene=tests/data/scenes/${part}_01
picture=""
set -- --model $part --scene "$scene" --unit mm
if [ -s build/release/client/viewer/page.html ]; then
  picture=build/quickstart.html
  set -- "$@" --view $picture --mesh tests/data/parts/$part.stl --mesh-unit mm --truth "$scene/gt.json"
fi
"$bin/binpose" detect "$@"

heading "Stop"
kill "$server"
wait "$server"
server=""
echo "server ended, its models are removed"

heading "Picture"
if [ -n "$picture" ]; then
  echo "open in a browser: file://$PWD/$picture"
else
  echo "none: npm could not fetch three.js. Where it can, start this again."
fi
