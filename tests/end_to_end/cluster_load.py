"""Callers that keep a cluster busy and notice every call that fails."""

import json
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import grpc

from binpose_process import BIN

PACKAGE = Path(__file__).resolve().parents[2] / "client/python"
_built = tempfile.TemporaryDirectory()
subprocess.run([sys.executable, "setup.py", "--quiet", "build", "--build-base", f"{_built.name}/build", "--build-lib",
                f"{_built.name}/lib"], cwd=PACKAGE, check=True, stderr=subprocess.DEVNULL)
sys.path.insert(0, f"{_built.name}/lib")
import binpose  # noqa: E402  before wire, which then takes the same binpose.v1
import wire  # noqa: E402

PAUSE = 0.05  # seconds between two scans of a caller


def box_stl():
    """A box of 40 x 30 x 20 mm: trained faster than any part."""
    corners = [(x, y, z) for x in (0, 40) for y in (0, 30) for z in (0, 20)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[a], *corners[b], *corners[c], 0) for a, b, c in triangles)
    return bytes(80) + struct.pack("<I", len(triangles)) + body


def train_request(model_id):
    """The cheapest training."""
    return wire.model.TrainRequest(
        id=model_id, mesh=wire.types.Mesh(data=box_stl(), unit=wire.types.LENGTH_UNIT_MILLIMETRE),
        params=wire.model.TrainParams(viewpoint_count=64, relative_sampling=0.1))


def cloud(points):
    """So many points of a plane, which cost little to search."""
    xyz = b"".join(struct.pack("<3f", i % 40, i // 40, 500) for i in range(points))
    return wire.types.PointCloud(unit=wire.types.LENGTH_UNIT_MILLIMETRE,
                                 points=wire.types.PackedPoints(width=points, height=1, xyz=xyz))


class Caller(threading.Thread):
    """Asks until it is stopped. `faults` are the calls that failed, `gap` the longest time between two answers."""

    def __init__(self, target, model_id):
        super().__init__(daemon=True)
        self.target, self.model_id = target, model_id
        self.stopping = threading.Event()
        self.answered, self.faults, self.gap, self._last = 0, [], 0, None
        self.start()

    def finish(self):
        self.stopping.set()
        self.join(120)
        if self.is_alive():
            self.faults.append("hangs")

    def note_answer(self):
        now = time.monotonic()
        self.gap = max(self.gap, now - (self._last or now))
        self._last = now
        self.answered += 1


class Streamer(Caller):
    """One stream of the Python client, with its retries; each scan has a size of its own, by which its answer is known."""

    def scans(self):
        number = 0
        while not self.stopping.is_set():
            yield cloud(200 + number % 100)
            number += 1
            time.sleep(PAUSE)

    def run(self):
        try:
            with binpose.Client(self.target) as client:
                for number, result in enumerate(client.detect_all(self.model_id, self.scans())):
                    if isinstance(result, Exception) or result.stats.point_count != 200 + number % 100:
                        self.faults.append(f"scan {number}: {result}")
                    self.note_answer()
        except Exception as error:
            self.faults.append(f"{error!r} {time.monotonic() - self._last:.1f} s after the last answer")


class PlainCaller(Caller):
    """Calls without any retry, a stream for each scan."""

    def run(self):
        api = wire.Api(self.target)
        request = wire.detection.DetectRequest(model_ids=[self.model_id], cloud=cloud(200))
        while not self.stopping.is_set():
            try:
                [answer] = api.detect([request], timeout=60, metadata=[("x-model-id", self.model_id)])
                if answer.HasField("error"):
                    self.faults.append(answer.error.message)
                self.note_answer()
            except grpc.RpcError as error:
                self.faults.append(f"{error.code().name}: {error.details()}")
                api = wire.Api(self.target)
            time.sleep(PAUSE)


class Command:
    """`binpose bench`: three streams of the C++ client for so many seconds."""

    def __init__(self, target, model_id, directory, seconds):
        scene = Path(directory) / "plane.pcd"
        scene.write_bytes(b"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 200\nHEIGHT 1\nPOINTS 200\n"
                          b"DATA binary\n" + cloud(200).points.xyz)
        self._process = subprocess.Popen(
            [BIN / "binpose", "bench", "--server", target, "--model", model_id, "--scene", scene, "--unit", "mm", "--rate",
             "15", "--streams", "3", "--duration", str(seconds), "--json"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def report(self):
        out, fault = self._process.communicate(timeout=300)
        report = json.loads(out) if out else {"due": -1, "answered": 0, "unsent": 0}
        return report, fault
