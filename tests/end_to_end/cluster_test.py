"""Three servers on one model directory behind HAProxy, as one service: what callers see when parts of it fail.
BINPOSE_CLUSTER=full runs the issue's whole figures; each test prints its figure as one line that starts with its name."""

import collections
import concurrent.futures
import contextlib
import functools
import hashlib
import os
import statistics
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import grpc

from cluster_load import Command, PlainCaller, Streamer, cloud, train_request  # before wire
import wire
from binpose_process import BIN
from cluster_hosts import (HAS_NAMESPACES, NAMES, PATIENCE, BalancerHost, ServerHost, make_certificates, make_network,
                           wait_for)

FULL = os.environ.get("BINPOSE_CLUSTER") == "full"
IDS = [f"part-{i}" for i in range(10)]
LOAD_SECONDS = 20 if FULL else 4
ROUNDS = 60 if FULL else 15  # of what is timed
GHOST = [("x-model-id", "ghost")]


def figure(name, text):
    print(f"{name}: {text}", flush=True)


def train(api, model_id):
    """The model, once a server has room for its training."""
    call = api._method("unary_stream", "ModelService/Train", wire.model.TrainRequest, wire.model.TrainResponse)
    while True:
        try:
            return list(call(train_request(model_id), timeout=600 * PATIENCE))[-1].model
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.RESOURCE_EXHAUSTED:
                raise
            time.sleep(0.2)


@functools.cache
@functools.cache  # encoded once, so that nobody's time counts it
def large_request():
    """A scan of 3.6 MB for a model that is not there, encoded."""
    points = wire.types.PackedPoints(width=300_800, height=1, xyz=bytes(3_609_600))
    large = wire.types.PointCloud(unit=wire.types.LENGTH_UNIT_MILLIMETRE, points=points)
    return wire.detection.DetectRequest(model_ids=["ghost"], cloud=large).SerializeToString()


def seconds_each(api):
    """Of large scans in one stream, each sent when the one before is answered."""
    starts, ends = [], []

    def frames():
        for _ in range(ROUNDS):
            starts.append(time.monotonic())
            yield large_request()
            wait_for(lambda: len(ends) == len(starts))
    for _ in api.detect_bytes(frames(), metadata=GHOST):
        ends.append(time.monotonic())
    return [end - start for start, end in zip(starts, ends)]


def models_of(server):
    return {(m.id, m.generation, m.content_hash) for m in wire.Api(server.target).models()}


def is_whole(file):
    """Whether a model file is what its checksum says; see server/model_envelope.cpp."""
    data = file.read_bytes()
    return data[32:64] == hashlib.sha256(data[:32] + data[64:]).digest()


def setUpModule():
    global directory, shared, servers, balancer
    directory = Path(unittest.enterModuleContext(tempfile.TemporaryDirectory()))
    shared = directory / "shared"
    shared.mkdir()
    make_network()
    servers = [ServerHost(name, 11 + i, shared, "--keep-generations", "1000") for i, name in enumerate(NAMES)]
    balancer = BalancerHost(directory, servers)
    for host in [*servers, balancer]:
        unittest.addModuleCleanup(host.kill)
        host.start()
    wait_for(lambda: balancer.serves_with(*NAMES), what="that all servers are up")
    api = wire.Api(balancer.target)
    train(api, IDS[0])
    wait_for(lambda: all(models_of(server) for server in servers))
    for model_id in IDS[1:]:
        api.import_model(model_id, api.export_model(IDS[0]))
    wait_for(lambda: all(len(models_of(server)) == len(IDS) for server in servers))
    figure("hosts", "network namespaces" if HAS_NAMESPACES else "addresses on loopback")


class ClusterTest(unittest.TestCase):
    maxDiff = None

    @contextlib.contextmanager
    def load(self, *, plain_faults_allowed=False):
        """Callers of three kinds on all models; afterwards, none with retries has seen a fault."""
        streamers = [Streamer(balancer.target, model_id) for model_id in IDS[:4]]
        plain = [PlainCaller(balancer.target, model_id) for model_id in IDS[4:7]]
        command = Command(balancer.target, IDS[7], directory, LOAD_SECONDS)
        callers = [*streamers, *plain]
        wait_for(lambda: all(caller.answered for caller in callers), what="that each caller has an answer")
        self.callers = callers
        yield callers
        answers = sum(caller.answered for caller in callers)
        wait_for(lambda: sum(caller.answered for caller in callers) > answers + 20, what="that callers go on")
        report, fault = command.report()
        for caller in callers:
            caller.finish()
        self.assertEqual([caller.faults for caller in streamers], [[]] * len(streamers))
        self.assertEqual((report["answered"] + report["unsent"], fault), (report["due"], ""))
        self.plain_faults = collections.Counter(fault.split(":")[0] for caller in plain for fault in caller.faults)
        if not plain_faults_allowed:
            self.assertEqual([caller.faults for caller in plain], [[]] * len(plain))
        self.answers = sum(caller.answered for caller in callers) + report["answered"]
        self.gap = max(caller.gap for caller in streamers)

    def restart(self, server):
        server.start()
        wait_for(lambda: balancer.serves_with(*NAMES), what="that all servers are up")

    def busiest(self):
        """The server with most streams."""
        return max(servers, key=lambda server: server.metric("binpose_detect_streams"))

    def test_a_server_that_is_killed_costs_callers_with_retries_no_frame(self):
        with self.load(plain_faults_allowed=True):
            victim = self.busiest()
            victim.kill()
            time.sleep(1)
            self.restart(victim)
        self.assertLessEqual(set(self.plain_faults), {"UNAVAILABLE"})
        figure("kill -9 of a server", f"{self.answers} answers; with retries none lost, longest gap {self.gap:.2f} s; "
               f"without, {sum(self.plain_faults.values())} calls UNAVAILABLE")

    def test_a_server_that_is_drained_costs_no_call(self):
        with self.load():
            victim = self.busiest()
            self.assertEqual(victim.terminate(), 0)
            self.restart(victim)
        figure("drain of a server", f"{self.answers} answers, no call failed, with retries or without; longest gap of a "
               f"stream {self.gap:.2f} s")

    @unittest.skipUnless(FULL, "takes half a minute")
    def test_servers_that_are_replaced_in_turn_cost_no_call(self):
        with self.load():
            for server in servers:
                self.assertEqual(server.terminate(), 0)
                self.restart(server)
        figure("rolling restart", f"{self.answers} answers, no call failed; longest gap of a stream {self.gap:.2f} s")

    @unittest.skipUnless(HAS_NAMESPACES and FULL, "needs hosts of their own, and half a minute")
    def test_a_server_whose_machine_vanishes_costs_callers_with_retries_no_frame(self):
        with self.load(plain_faults_allowed=True):
            victim = self.busiest()
            victim.pull_the_plug()
            wait_for(lambda: not balancer.servers()[victim.name]["status"].startswith("UP"), what="that it is noticed")
            time.sleep(20)
            victim.put_the_plug_back()
            wait_for(lambda: balancer.serves_with(*NAMES), what="that all servers are up")
        figure("network of a server cut", f"{self.answers} answers; with retries none lost, longest gap {self.gap:.2f} s")

    def test_a_balancer_that_is_killed_and_started_again_costs_callers_with_retries_no_frame(self):
        with self.load(plain_faults_allowed=True):
            balancer.kill()
            time.sleep(0.5)
            balancer.start()
        self.assertLessEqual(set(self.plain_faults), {"UNAVAILABLE"})
        figure("kill -9 of the balancer, half a second", f"{self.answers} answers; with retries none lost, longest gap "
               f"{self.gap:.2f} s; without, {sum(self.plain_faults.values())} calls UNAVAILABLE")

    def test_servers_cut_off_from_the_directory_serve_on_and_catch_up(self):
        for cut in [servers[:1], servers] if FULL else [servers]:
            with self.load():
                for server in cut:
                    server.cut_off()
                for server in cut:
                    wait_for(lambda: "model directory has not been read" in server.page("/readyz"))
                    self.assertGreater(server.metric("binpose_model_directory_age_seconds"), 4)
                    with self.assertRaises(grpc.RpcError) as caught:
                        train(wire.Api(server.target), IDS[0])
                    self.assertEqual(caught.exception.code(), grpc.StatusCode.UNAVAILABLE)
                others = [server for server in servers if server not in cut]
                for server in others:
                    train(wire.Api(server.target), IDS[0])
                for server in cut:
                    server.join()
                caught_up = wait_for(lambda: len({frozenset(models_of(server)) for server in servers}) == 1)
            figure(f"{len(cut)} of 3 cut off from the directory", f"{self.answers} answers, no call failed; all on the same "
                   f"models {caught_up:.2f} s after it was back")

    def test_trainings_at_once_are_generations_in_a_row(self):
        count, model_ids = (200, IDS) if FULL else (9, IDS[:3])
        before = {model_id: max(g for i, g, _ in models_of(servers[0]) if i == model_id) for model_id in model_ids}
        apis = [wire.Api(server.target) for server in servers]
        start = time.monotonic()
        with concurrent.futures.ThreadPoolExecutor(count) as pool:
            done = list(pool.map(lambda i: train(apis[i % 3], model_ids[i // 3 % len(model_ids)]), range(count)))
        took = time.monotonic() - start
        agreed = wait_for(lambda: len({frozenset(models_of(server)) for server in servers}) == 1)
        for model_id in model_ids:
            generations = sorted(model.generation for model in done if model.id == model_id)
            self.assertEqual(generations, list(range(before[model_id] + 1, before[model_id] + 1 + len(generations))))
        for model in done:
            file = shared / f"{model.id}@{model.generation}.model"
            self.assertTrue(is_whole(file), file)
            self.assertEqual(file.stat().st_size, model.file_bytes)
        self.assertLessEqual({(m.id, m.generation, m.content_hash) for m in done
                              if m.generation == max(o.generation for o in done if o.id == m.id)}, models_of(servers[0]))
        figure("trainings at once", f"{count} of {len(model_ids)} IDs on 3 servers in {took:.1f} s, each acknowledged generation "
               f"there and whole; all servers on the same set {agreed:.2f} s after the last")

    def where(self, model_ids):
        """The server of each, by HAProxy's counters."""
        api = wire.Api(balancer.target)
        places = {}
        for model_id in model_ids:
            before = balancer.calls()
            list(api.detect([wire.detection.DetectRequest()], timeout=60, metadata=[("x-model-id", model_id)]))
            [places[model_id]] = [name for name, calls in balancer.calls().items() if calls > before.get(name, 0)]
        return places

    def test_models_spread_over_the_servers_and_stay_where_they_are(self):
        model_ids = [f"model-{i}" for i in range(200)]
        first = self.where(model_ids)
        self.assertEqual(self.where(model_ids), first)
        servers[0].terminate()
        wait_for(lambda: balancer.serves_with(*NAMES[1:]))
        without = self.where(model_ids)
        self.restart(servers[0])
        moved = [model_id for model_id in model_ids if first[model_id] != "one" and without[model_id] != first[model_id]]
        spread = collections.Counter(first.values())
        self.assertEqual((len(spread), moved), (3, []))
        self.assertGreater(min(spread.values()), 200 / 3 / 2)
        self.assertEqual(self.where(model_ids), first)
        figure("200 model IDs", f"{dict(spread)}; asked again, all at the same server; with one server gone none of the "
               "others moved, and all are back when it is")

    def test_without_the_header_calls_go_in_turn(self):
        before = balancer.calls()
        for _ in range(30):
            wire.Api(balancer.target).models()
        calls = [calls - before[name] for name, calls in balancer.calls().items()]
        self.assertEqual(sum(calls), 30)
        self.assertGreaterEqual(min(calls), 7)  # in turn but for a balance that other streams left behind

    def test_a_cancel_reaches_the_server(self):
        api = wire.Api(balancer.target)
        stop = threading.Event()

        def scans():
            yield wire.detection.DetectRequest(model_ids=[IDS[0]], cloud=cloud(200))
            stop.wait()

        streams = lambda: sum(server.metric("binpose_detect_streams") for server in servers)
        call = api.detect(scans(), metadata=[("x-model-id", IDS[0])])
        next(call)
        self.assertEqual(streams(), 1)
        call.cancel()
        took = wait_for(lambda: streams() == 0, what="that the stream ends at the server")
        stop.set()
        figure("cancel through the balancer", f"the stream is gone at the server {took:.2f} s later")

    def test_tls_from_end_to_end(self):
        tls = directory / "tls"
        server = ServerHost("secure", 21, shared, "--tls-cert", tls / "server.pem", "--tls-key", tls / "server.key")
        proxy = BalancerHost(directory, [server], 22, "tls-proxy", tls)
        make_certificates(tls, server=server.address, balancer=proxy.address)
        for host in (server, proxy):
            self.addCleanup(host.kill)
            host.start()
        wait_for(lambda: proxy.serves_with("one"), what="that the server is up")
        run = subprocess.run([BIN / "binpose", "models", "--server", proxy.target, "--tls-ca", tls / "ca.pem"],
                             capture_output=True, text=True, timeout=120)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn(IDS[0], run.stdout)
        ca = (tls / "ca.pem").read_bytes()
        apis = {"plain": (wire.Api(servers[0].target), wire.Api(balancer.target)),
                "TLS": (wire.Api(server.target, ca), wire.Api(proxy.target, ca))}
        ms = {name: [1000 * statistics.median(seconds_each(api)) for api in pair] for name, pair in apis.items()}
        figure("3.6 MB over TLS", "; ".join(f"{name} {direct:.1f} ms direct, {through:.1f} ms through the balancer"
                                            for name, (direct, through) in ms.items()) + f" (medians of {ROUNDS})")

    def test_what_the_balancer_costs(self):
        server = self.where(["ghost"])["ghost"]
        direct = next(host.target for host in servers if host.name == server)
        apis = {target: wire.Api(target) for target in (direct, balancer.target)}
        took = {(target, False): seconds_each(api) for target, api in apis.items()}
        took.update({(target, True): [] for target in apis})
        for _ in range(ROUNDS):  # in turn, a stream for each
            for target, api in apis.items():
                start = time.monotonic()
                list(api.detect_bytes([large_request()], metadata=GHOST))
                took[target, True].append(time.monotonic() - start)
        ms = {key: 1000 * statistics.median(values) for key, values in took.items()}
        figure("3.6 MB through the balancer",
               f"in one stream {ms[direct, False]:.1f} ms direct, {ms[balancer.target, False]:.1f} ms through it; a stream "
               f"for each {ms[direct, True]:.1f} and {ms[balancer.target, True]:.1f} ms (medians of {ROUNDS})")
        self.assertLess(ms[balancer.target, False] - ms[direct, False], 100)  # the bar is 8 ms, on a machine at rest


if __name__ == "__main__":
    unittest.main()
