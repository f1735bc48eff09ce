#!/bin/sh
# Builds the container images where no Docker engine runs, and tries the server out of its image: trained, detected,
# stopped; unprivileged, on a root that cannot be written. Needs root, buildah and debootstrap, and a network.
# Usage: test-image.sh DIRECTORY [MIRROR]; the directory is made or used again, and is yours to delete.
set -eu
mirror=${2:-http://deb.debian.org/debian}
mkdir -p "$1"
work=$(cd "$1" && pwd)
cd "$(dirname "$0")/.."

root="$work/root"
server=""
container=""

# buildah with everything below the directory; chroot isolation needs no engine and no namespaces.
build_tool() {
  tool=$1
  shift
  buildah --root "$work/storage" --runroot "$work/run" --storage-driver vfs "$tool" "$@"
}

finish() {
  [ -z "$server" ] || { kill "$server" && wait "$server"; } || true
  for mount in "$root/models" "$root/proc" "$root"; do
    mountpoint -q "$mount" && umount "$mount"
  done
  [ -z "$container" ] || build_tool rm "$container" >/dev/null
}
trap finish EXIT

echo "== Base image"
base=docker.io/library/debian:bookworm-slim
if ! build_tool images -q "$base" >/dev/null 2>&1; then
  debootstrap --variant=minbase bookworm "$work/debian" "$mirror" >"$work/debootstrap.log"
  rm -rf "$work/debian/var/cache/apt/archives" "$work/debian/usr/share/doc" "$work/debian/usr/share/man" \
    "$work/debian/usr/share/locale"
  empty=$(build_tool from scratch)
  build_tool add --quiet "$empty" "$work/debian" / >/dev/null
  build_tool commit --quiet "$empty" "$base" >/dev/null
  build_tool rm "$empty" >/dev/null
fi

echo "== Images"
for target in server cli; do
  build_tool bud --isolation chroot --pull-never --format docker --layers --target "$target" --tag "binpose-$target" . \
    >"$work/$target.log" 2>&1 || { tail -40 "$work/$target.log"; exit 1; }
done
build_tool images --format '{{.Name}} {{.Size}}' | grep binpose

echo "== Server out of its image, as its user, on a read-only root"
container=$(build_tool from --pull-never binpose-server)
mkdir -p "$root" "$work/models"
mount --bind "$(build_tool mount "$container")" "$root"
mount -o remount,ro,bind "$root"
mount --bind "$work/models" "$root/models"
mount --bind /proc "$root/proc"
cp tests/data/parts/bearing_support.stl "$work/models/part.stl"
cp -r tests/data/scenes/bearing_support_01 "$work/models/scene"
chown -R 10001 "$work/models"

# Runs a command in the image, as the image's user. No function: in the background it would be a shell's child.
inside="chroot --userspec=binpose $root env -i PATH=/usr/local/bin:/usr/bin:/bin"
if $inside touch /usr/local/written 2>/dev/null; then
  echo "the root file system can be written" >&2
  exit 1
fi
mkfifo "$work/stdout" 2>/dev/null || true
$inside binpose-server --listen 127.0.0.1:0 --metrics 127.0.0.1:0 --model-dir /models \
  >"$work/stdout" 2>"$work/binpose-server.log" &
server=$!
exec 3<"$work/stdout"
read -r addresses <&3 || { cat "$work/binpose-server.log"; exit 1; }
echo "$addresses"
address=${addresses#listening on }
address=${address%%,*}

$inside binpose --server "$address" health
$inside binpose --server "$address" train --id part --mesh /models/part.stl --unit mm | head -1
$inside binpose --server "$address" detect --model part --scene /models/scene --unit mm | tee "$work/detect.log" | head -3
grep -q " found in " "$work/detect.log"
if grep -q "nothing found" "$work/detect.log"; then exit 1; fi

echo "== Stop"
# chroot has become the server: its process ends on the signal that the image names.
kill -TERM "$server"
wait "$server"
server=""
echo "ended with status 0"
