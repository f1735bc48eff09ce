#!/bin/sh
# Tries what the README promises where nothing is installed: a bare Debian 12 in a chroot, a clone of HEAD, both
# commands, each twice. Needs root, debootstrap and a network. Prints how long each run took.
# Usage: fresh_debian.sh DIRECTORY [MIRROR]; the directory is made, and is yours to delete.
set -eu
directory=$1
mirror=${2:-http://deb.debian.org/debian}
cd "$(dirname "$0")/.."

debootstrap --variant=minbase bookworm "$directory" "$mirror" >/dev/null
git clone --quiet . "$directory/binpose"
echo "127.0.0.1 localhost" >"$directory/etc/hosts"  # which Debian's installer writes, not debootstrap
trap 'umount "$directory/proc" "$directory/dev/pts" "$directory/dev"' EXIT
mount --bind /proc "$directory/proc"
mount --bind /dev "$directory/dev"
mount --bind /dev/pts "$directory/dev/pts"

for command in deploy/quickstart.sh deploy/quickstart.sh tests/run.sh tests/run.sh; do
  start=$(date +%s)
  chroot "$directory" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root "/binpose/$command"
  echo "#### $command: $(($(date +%s) - start)) s"
done
