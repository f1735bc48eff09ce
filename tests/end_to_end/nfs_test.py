"""Three servers on one model directory, each through an NFS mount of its own; nfs.sh boots the machine for it. Each test
prints its figure as one line that starts with its name."""

import concurrent.futures
import contextlib
import tempfile
import threading
import time
import unittest
from pathlib import Path

import grpc

from cluster_load import PlainCaller, cloud  # before wire
import wire
from cluster_hosts import PATIENCE, make_network, wait_for
from cluster_test import figure, is_whole, models_of, train
from nfs_hosts import EXPORTED, FileServer, NfsServerHost

MOUNTS = {  # as in deploy/README.md
    "one": "vers=4.2,softerr,timeo=20,retrans=2,actimeo=1",
    "two": "vers=4.2,hard,actimeo=1",
    "three": "vers=3,nolock,hard,actimeo=1",
}
SPARES = [f"spare-{i}" for i in range(4)]  # with "gear" more than the servers keep in memory


def setUpModule():
    global files, servers, model
    make_network()
    files = FileServer(3)
    servers = [NfsServerHost(name, 11 + i, files, options) for i, (name, options) in enumerate(MOUNTS.items())]
    for server in servers:
        unittest.addModuleCleanup(server.kill)
    restart(2)
    train(api(servers[0]), "gear")
    model = api(servers[0]).export_model("gear")
    for i, model_id in enumerate(SPARES):
        api(servers[i % 3]).import_model(model_id, model)
    wait_for(agree)


def restart(keep_generations):
    for server in servers:
        server.kill()
        server.arguments = ["--models-memory-mib", "10", "--keep-generations", str(keep_generations)]
        server.start()


def api(server):
    return wire.Api(server.target)


def agree():
    return len({frozenset(models_of(server)) for server in servers}) == 1


def code_of(call):
    """The name of a call's status, and the seconds that it took."""
    start = time.monotonic()
    try:
        call()
        return "OK", time.monotonic() - start
    except grpc.RpcError as error:
        return error.code().name, time.monotonic() - start


def detect(server, model_id):
    [answer] = api(server).detect([wire.detection.DetectRequest(model_ids=[model_id], cloud=cloud(200))], timeout=100 * PATIENCE)
    return answer.error.code


class PublicationTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        restart(1000)

    def assert_whole(self, models):
        for m in models:
            file = EXPORTED / f"{m.id}@{m.generation}.model"
            self.assertTrue(is_whole(file), file)

    def test_generations_put_at_once_are_in_a_row(self):
        jobs = [(i % 7 == 0, servers[i % 3], f"rush-{i % 2}") for i in range(36)]

        def put(job):
            is_training, server, model_id = job
            return train(api(server), model_id) if is_training else api(server).import_model(model_id, model)
        start = time.monotonic()
        with concurrent.futures.ThreadPoolExecutor(12) as pool:
            done = list(pool.map(put, jobs))
        took = time.monotonic() - start
        for model_id in ("rush-0", "rush-1"):
            generations = sorted(m.generation for m in done if m.id == model_id)
            self.assertEqual(generations, list(range(1, len(generations) + 1)))
        self.assert_whole(done)
        wait_for(agree)
        figure("put at once", f"6 trainings and 30 imports of two IDs through three mounts in {took:.0f} s: each acknowledged "
               "generation there and whole, in a row")

    def test_a_server_that_is_killed_loses_nothing_that_it_acknowledged(self):
        done, kills = [], 3

        def put(caller):
            with contextlib.suppress(grpc.RpcError):
                while True:
                    done.append(api(servers[1]).import_model(f"killed-{caller}", model))
        for _ in range(kills):
            count = len(done)
            threads = [threading.Thread(target=put, args=[caller]) for caller in range(3)]
            for thread in threads:
                thread.start()
            wait_for(lambda: len(done) > count + 3)
            servers[1].kill()
            for thread in threads:
                thread.join()
            servers[1].start()
        self.assert_whole(done)
        wait_for(agree)
        served = {(i, g) for i, g, _ in models_of(servers[2])}
        for model_id in {m.id for m in done}:
            newest = max(m.generation for m in done if m.id == model_id)
            self.assertTrue(any(i == model_id and g >= newest for i, g in served), served)
        figure("kill -9 while importing", f"{kills} kills, {len(done)} acknowledged generations, each there and whole")


class FaultTest(unittest.TestCase):
    def test_servers_detect_from_memory_while_the_file_server_is_away(self):
        ways = {"cable pulled": (files.pull_the_plug, files.put_the_plug_back), "nfsd stopped": (files.stop, files.start)}
        for way, (take_away, bring_back) in ways.items():
            with self.subTest(way):
                for server in servers:
                    self.assertEqual([detect(server, model_id) for model_id in [*SPARES, "gear"]], [0] * 5)
                    api(server).import_model("victim", model)
                callers = [PlainCaller(server.target, "gear") for server in servers]
                wait_for(lambda: all(caller.answered for caller in callers))
                for caller in callers:
                    caller.gap = 0
                take_away()
                # Calls of all kinds that need the directory, before anybody knows, and then one after the other.
                calls = {"import": lambda server: api(server).import_model("new", model),
                         "delete": lambda server: api(server).delete("victim"),
                         "detect": lambda server: self.assertEqual(detect(server, SPARES[0]), 14)}
                with concurrent.futures.ThreadPoolExecutor(9) as pool:
                    early = list(pool.map(lambda c: code_of(lambda: c[0](c[1])),
                                          [(call, server) for call in calls.values() for server in servers]))
                for server in servers:
                    wait_for(lambda: "model directory has not been read" in server.page("/readyz"))
                    self.assertGreater(server.metric("binpose_model_directory_age_seconds"), 4)
                answered = [caller.answered for caller in callers]
                late = [code_of(lambda: call(server)) for call in calls.values() for server in servers]
                self.assertEqual([code for code, _ in early[:6] + late[:6]], ["UNAVAILABLE"] * 12)  # "detect" asserts itself
                wait_for(lambda: all(caller.answered > before + 5 for caller, before in zip(callers, answered)))
                gap = max(caller.gap for caller in callers)
                bring_back()
                back = wait_for(lambda: all(server.metric("binpose_model_directory_age_seconds") < 2 for server in servers))
                api(servers[0]).import_model("after", model)
                wait_for(agree)
                for caller in callers:
                    caller.finish()
                self.assertEqual([caller.faults for caller in callers], [[]] * 3)
                self.assertEqual([detect(server, SPARES[0]) for server in servers], [0] * 3)
                figure(way, f"{sum(caller.answered for caller in callers)} detections from memory, none failed, longest gap "
                       f"{gap:.1f} s while it was away; what needs the directory UNAVAILABLE after at most "
                       f"{max(s for _, s in early):.1f} s, later {max(s for _, s in late):.1f} s; read again {back:.1f} s "
                       "after it was back")

    def test_a_server_ends_while_the_file_server_is_away(self):
        files.pull_the_plug()
        self.addCleanup(restart, 2)
        self.addCleanup(files.put_the_plug_back)
        for server in servers:
            wait_for(lambda: "model directory has not been read" in server.page("/readyz"))
        start = time.monotonic()
        for server in servers:
            self.assertEqual(server.terminate(), 0)
        figure("end without the file server", f"{(time.monotonic() - start) / 3:.1f} s a server")

    def test_a_server_ends_while_it_waits_for_the_file_server_at_its_start(self):
        waiting = servers[1:]  # by "hard" mounts
        for server in waiting:
            server.kill()
        files.pull_the_plug()
        self.addCleanup(restart, 2)
        self.addCleanup(files.put_the_plug_back)
        logs = [self.enterContext(tempfile.NamedTemporaryFile("w+")) for _ in waiting]
        for server, log in zip(waiting, logs):
            server.launch("info", stderr=log)
        told = wait_for(lambda: all("is away since" in Path(log.name).read_text() for log in logs))
        start = time.monotonic()
        for server in waiting:
            self.assertEqual(server.terminate(), 0)
        figure("end before serving", f"the log tells after {told:.1f} s that the directory is away; ended after "
               f"{(time.monotonic() - start) / len(waiting):.2f} s a server")


if __name__ == "__main__":
    unittest.main(verbosity=2)  # a test takes minutes when emulated
