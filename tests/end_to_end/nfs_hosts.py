"""A file server and hosts that mount it, as network namespaces of one machine: each is an NFS client of its own."""

import subprocess
from pathlib import Path

from cluster_hosts import Host, ServerHost, ip

EXPORTED = Path("/run/models")  # a disk of its own


class FileServer(Host):
    """Debian's kernel NFS server."""

    def __init__(self, number):
        super().__init__("files", number)
        Path("/etc/exports").write_text(f"{EXPORTED} *(rw,no_root_squash,no_subtree_check,fsid=0)\n")
        self._here("mount -t nfsd nfsd /proc/fs/nfsd && echo 10 >/proc/fs/nfsd/nfsv4gracetime && rpcbind -w && "
                   "exportfs -a && rpc.mountd")
        self.start()

    def _here(self, script):
        subprocess.run(["nsenter", f"--net=/run/netns/{self.name}", "sh", "-c", script], check=True)

    def start(self):
        self._here("rpc.nfsd 8")

    def stop(self):
        self._here("rpc.nfsd 0")


class NfsServerHost(ServerHost):
    """A server that mounts the export. The kernel caches for each network namespace, as for each machine, apart."""

    def __init__(self, name, number, files, options):
        Host.__init__(self, name, number)
        self.models = Path(f"/run/{name}")
        self.models.mkdir()
        export = "/" if "vers=4" in options else EXPORTED
        subprocess.run(["unshare", "--uts", "sh", "-c",  # to a file server of version 4, clients of one name are one
                        f"hostname {name} && exec nsenter --net=/run/netns/{name} "
                        f"mount -t nfs {files.address}:{export} {self.models} -o {options}"], check=True)
