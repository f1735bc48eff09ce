"""Hosts of a cluster on this machine: three servers and HAProxy, as deploy/haproxy/haproxy.cfg joins them."""

import csv
import os
import shutil
import signal
import subprocess
import time
import urllib.request
from pathlib import Path

from binpose_process import BIN

CONFIG = Path(__file__).resolve().parents[2] / "deploy/haproxy/haproxy.cfg"
NAMES = ["one", "two", "three"]
HAS_NAMESPACES = os.environ.get("BINPOSE_CLUSTER_HOSTS") == "namespaces"
PATIENCE = float(os.environ.get("BINPOSE_PATIENCE", 1))  # as often as usual is waited, where all is slow
NETWORK = "10.77.0" if HAS_NAMESPACES else f"127.{os.getpid() % 250 + 1}.77"


def wait_for(condition, seconds=120, what="what was waited for"):
    """Seconds until the condition came true."""
    start = time.monotonic()
    while not condition():
        if time.monotonic() - start > PATIENCE * seconds:
            raise AssertionError(f"{what} did not happen within {PATIENCE * seconds} s")
        time.sleep(0.02)
    return time.monotonic() - start


def get(url):
    """The text of a page; empty where none is served."""
    try:
        with urllib.request.urlopen(url, timeout=10) as page:
            return page.read().decode()
    except OSError:
        return ""


def make_network():
    if HAS_NAMESPACES:
        ip("link", "add", "cluster", "type", "bridge")
        ip("addr", "add", f"{NETWORK}.1/24", "dev", "cluster")
        ip("link", "set", "cluster", "up")


def ip(*arguments):
    subprocess.run(["ip", *arguments], check=True)


def make_certificates(folder, **addresses):
    """ca.pem and, for each name, NAME.key and NAME.pem, the chain with the key."""
    folder.mkdir(exist_ok=True)
    openssl = lambda *arguments: subprocess.run(["openssl", *arguments], cwd=folder, check=True, capture_output=True)
    openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=test", "-keyout", "ca.key", "-out",
            "ca.pem")
    for name, address in addresses.items():
        openssl("req", "-newkey", "rsa:2048", "-nodes", "-subj", f"/CN={name}", "-keyout", f"{name}.key", "-out", "csr")
        (folder / "extensions").write_text(f"subjectAltName=IP:{address}\n")
        openssl("x509", "-req", "-in", "csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days", "2",
                "-extfile", "extensions", "-out", f"{name}.pem")
        with (folder / f"{name}.pem").open("a") as chain:
            chain.write((folder / f"{name}.key").read_text())


class Host:
    """An address, with a network stack of its own where that can be had."""

    def __init__(self, name, number):
        self.name, self.address, self.process = name, f"{NETWORK}.{number}", None
        self.target = f"{self.address}:50051"  # where it serves calls, if it does
        if HAS_NAMESPACES:
            ip("netns", "add", name)
            ip("link", "add", f"to-{name}", "type", "veth", "peer", "name", "eth0", "netns", name)
            ip("link", "set", f"to-{name}", "master", "cluster", "up")
            ip("-n", name, "addr", "add", f"{self.address}/24", "dev", "eth0")
            ip("-n", name, "link", "set", "eth0", "up")
            ip("-n", name, "link", "set", "lo", "up")

    def run(self, *command, **options):
        within = ["ip", "netns", "exec", self.name] if HAS_NAMESPACES else []
        self.process = subprocess.Popen([*within, *command], **options)

    def pull_the_plug(self):
        ip("link", "set", f"to-{self.name}", "down")

    def put_the_plug_back(self):
        ip("link", "set", f"to-{self.name}", "up")

    def kill(self):
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def terminate(self):
        """Ends it as an administrator would."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout=300 * PATIENCE)


class ServerHost(Host):
    """A server; its model directory is a link, so that it can be cut off."""

    def __init__(self, name, number, shared, *arguments):
        super().__init__(name, number)
        self.shared, self.arguments = shared, arguments
        self.models = shared.parent / f"models-{name}"
        self.models.symlink_to(shared)

    def start(self):
        self.launch("error")
        wait_for(self.is_ready, what=f"that {self.name} is ready")

    def launch(self, log_level, **options):
        self.run(BIN / "binpose-server", "--listen", self.target, "--metrics", f"{self.address}:9464",
                 "--model-dir", self.models, "--threads", "1", "--log-level", log_level, "--drain-delay", "2",
                 *([] if "--tls-cert" in self.arguments else ["--insecure"]), *self.arguments,
                 stdout=subprocess.DEVNULL, **options)

    def page(self, path):
        return get(f"http://{self.address}:9464{path}")

    def is_ready(self):
        return self.page("/readyz").startswith("ready")

    def metric(self, name):
        return sum(float(line.rsplit(" ", 1)[1]) for line in self.page("/metrics").splitlines() if line.startswith(name))

    def cut_off(self):
        """What is left where a share was mounted: an empty folder."""
        empty = self.shared.parent / "unmounted"
        empty.mkdir(exist_ok=True)
        self._point_to(empty)

    def join(self):
        self._point_to(self.shared)

    def _point_to(self, target):
        new = self.models.with_suffix(".new")
        new.symlink_to(target)
        new.rename(self.models)


class BalancerHost(Host):
    """HAProxy with deploy/'s configuration, but for the addresses."""

    def __init__(self, directory, servers, number=2, name="balancer", tls=None):
        super().__init__(name, number)
        text = CONFIG.read_text().replace("bind :50051", f"bind {self.target}")
        for i, server in enumerate(servers):
            text = text.replace(f"192.0.2.{11 + i}", server.address)
        self.config = directory / f"{name}.cfg"
        self.config.write_text(text.replace("127.0.0.1:8404", f"{self.address}:8404"))
        self.environment = {**os.environ, **({"TLS_DIR": str(tls)} if tls else {})}

    def start(self):
        self.run(shutil.which("haproxy"), "-db", "-q", "-f", self.config, env=self.environment, stderr=subprocess.DEVNULL)
        wait_for(lambda: self.servers(), what="that the balancer is ready")

    def servers(self):
        """What HAProxy says of each server, by name."""
        lines = get(f"http://{self.address}:8404/;csv").lstrip("# ").splitlines()
        return {row["svname"]: row for row in csv.DictReader(lines) if row["pxname"] == "servers" and row["svname"] in NAMES}

    def serves_with(self, *names):
        return [name for name, row in self.servers().items() if row["status"].startswith("UP")] == list(names)

    def calls(self):
        return {name: int(row["stot"]) for name, row in self.servers().items()}
