#!/bin/sh
# The first process of the machine that nfs.sh boots. Usage: nfs_machine.sh [TEST...]
export PATH=/usr/sbin:/usr/bin HOME=/root BINPOSE_CLUSTER_HOSTS=namespaces BINPOSE_PATIENCE=10
mount -t sysfs sys /sys
for folder in /tmp /run; do mount -t tmpfs memory $folder; done
mkdir -p /run/netns /run/models /run/rpcbind /run/sendsigs.omit.d
modprobe -a virtio_blk ext4 nfsd nfsv3 nfsv4 veth bridge
mount /dev/vda /run/models
echo "_rpc:x:190:65534::/run/rpcbind:/usr/sbin/nologin
statd:x:191:65534::/var/lib/nfs:/usr/sbin/nologin" >>/etc/passwd
ip link set lo up
if /usr/bin/python3 "$(dirname "$0")/nfs_test.py" "$@" 2>&1; then echo "nfs: passed"; else echo "nfs: failed"; fi
sync
busybox reboot -f
