#!/bin/sh
# Proves on a real NFS what the model directory promises: boots Debian's kernel over this machine's own files, read-only,
# in which a file server and three hosts, each with a mount of its own, are network namespaces. Prints a figure for each
# promise. Usage: nfs.sh BIN [TEST...]; BIN is where the build put its binaries. The packages that are missing here are
# unpacked beside it, not installed. BINPOSE_ACCEL=kvm is faster where it works. Exits with 77 without qemu.
set -eu
if ! command -v qemu-system-x86_64 >/dev/null; then
  echo "Skipped: no qemu-system-x86_64; apt-get install --no-install-recommends qemu-system-x86 brings it."
  exit 77
fi
bin="$(cd "$1" && pwd)"
case "$bin/" in /tmp/*|/run/*) echo "$bin cannot be seen in the machine, which has a /tmp and a /run of its own."; exit 2 ;; esac
shift
tests="$(cd "$(dirname "$0")" && pwd)"
machine="$(dirname "$bin")/nfs"
layer="$machine/layer"  # of files, over this machine's own
mkdir -p "$machine"
cd "$machine"

unpack_packages() {
  rm -rf packages fresh
  mkdir -p packages fresh/usr/bin fresh/usr/sbin fresh/usr/lib
  for folder in bin sbin lib; do ln -s "usr/$folder" "fresh/$folder"; done
  kernel="$(apt-cache depends linux-image-amd64 | sed -n 's/^  Depends: //p')"
  (cd packages && apt-get -q download "$kernel" busybox-static kmod libkmod2 iproute2 nfs-kernel-server nfs-common keyutils \
    rpcbind libnfsidmap1 libtirpc3 libtirpc-common libwrap0 libevent-core-2.1-7)
  for package in packages/*.deb; do
    dpkg-deb --fsys-tarfile "$package" | tar -x --keep-directory-symlink -C fresh
  done
  version="$(ls fresh/lib/modules)"
  LD_LIBRARY_PATH=fresh/usr/lib/x86_64-linux-gnu fresh/sbin/depmod -b fresh "$version" 2>/dev/null ||
    { ln -s kmod fresh/bin/depmod; LD_LIBRARY_PATH=fresh/usr/lib/x86_64-linux-gnu fresh/bin/depmod -b fresh "$version"; }
  rm -r packages
  mv fresh "$layer"
}

# What the kernel starts with: as much as it needs to see this machine's files.
make_first_files() {  # TEST...
  rm -rf first
  mkdir -p first/bin first/dev first/proc first/sys first/layer first/host first/memory first/all
  cp "$layer/bin/busybox" first/bin
  (cd "$layer" && cp --parents -r lib/modules/*/modules.* lib/modules/*/kernel/drivers/virtio lib/modules/*/kernel/net/9p \
    lib/modules/*/kernel/fs/9p lib/modules/*/kernel/fs/netfs lib/modules/*/kernel/fs/fscache \
    lib/modules/*/kernel/fs/overlayfs "$machine/first")
  cat >first/init <<END
#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t devtmpfs dev /dev
for module in virtio_pci 9pnet_virtio 9p overlay; do modprobe \$module; done
for folder in layer host; do
  mount -t 9p -o ro,trans=virtio,version=9p2000.L,msize=512000,cache=loose \$folder /\$folder
done
mount -t tmpfs memory /memory
mkdir /memory/upper /memory/work
mount -t overlay -o lowerdir=/layer:/host,upperdir=/memory/upper,workdir=/memory/work all /all
for folder in proc dev; do mount --move /\$folder /all/\$folder; done
exec switch_root /all /usr/bin/env BINPOSE_BIN=$bin /bin/sh $tests/nfs_machine.sh $*
END
  chmod +x first/init
  (cd first && find . | "$layer/bin/busybox" cpio -o -H newc 2>/dev/null | gzip -1) >first.cpio.gz
}

[ -d "$layer" ] || unpack_packages
make_first_files "$@"
rm -f models.img
truncate -s 512M models.img
/usr/sbin/mkfs.ext4 -q models.img
qemu-system-x86_64 -accel "${BINPOSE_ACCEL:-tcg}" -cpu max -smp 2 -m 3G -nographic -no-reboot -nic none \
  -kernel "$layer"/boot/vmlinuz-* -initrd first.cpio.gz -append "console=ttyS0 quiet panic=-1" \
  -virtfs local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap \
  -virtfs local,path="$layer",mount_tag=layer,security_model=none,readonly=on \
  -drive file=models.img,format=raw,if=virtio </dev/null 2>qemu.log | sed -u 's/\r$//' | tee console.log
grep -qx "nfs: passed" console.log
