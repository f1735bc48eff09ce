"""The Python package, built as its README says, against a server."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from binpose_process import Server

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "client/python"
PART = ROOT / "tests/data/parts/bearing_support.stl"
SCENE = ROOT / "tests/data/scenes/bearing_support_01"
EMPTY = ROOT / "tests/data/scenes/empty_bin_01"


def setUpModule():
    global directory, server, built, binpose, grpc, np, depth, camera
    directory = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(directory.cleanup)
    built = Path(directory.name) / "python"
    subprocess.run([sys.executable, "setup.py", "--quiet", "build", "--build-base", Path(directory.name) / "build",
                    "--build-lib", built], cwd=PACKAGE, check=True)
    sys.path.insert(0, str(built))
    import binpose
    import grpc
    import numpy as np
    from PIL import Image
    camera = json.loads((SCENE / "camera.json").read_text())
    depth = np.asarray(Image.open(SCENE / "depth.png")).astype(np.uint16)
    server = Server(Path(directory.name) / "models")
    unittest.addModuleCleanup(server.stop)
    server.binpose_json("train", "--id", "part", "--mesh", PART, "--unit", "mm")


def scan(pixels=None, **changes):
    lens = {name: camera[name] for name in ("fx", "fy", "cx", "cy")}
    arguments = {**lens, "unit": "mm", "scale": camera["depth_unit_mm"], **changes}
    return binpose.depth_image(depth if pixels is None else pixels, **arguments)


def cloud_of(pixels):
    """The depth image as organised points, millimetres."""
    z = np.where(pixels > 0, pixels * camera["depth_unit_mm"], np.nan)
    v, u = np.indices(z.shape)
    return np.dstack([(u - camera["cx"]) * z / camera["fx"], (v - camera["cy"]) * z / camera["fy"], z])


class PythonTest(unittest.TestCase):
    def setUp(self):
        self.client = binpose.Client(server.address)
        self.addCleanup(self.client.close)

    def test_finds_what_the_command_finds(self):
        [answer] = server.binpose_json("detect", "--model", "part", "--scene", SCENE, "--unit", "mm")
        result = self.client.detect("part", scan())
        self.assertEqual([part.score for part in result.parts], [h["score"] for h in answer["hypotheses"]])
        position = answer["hypotheses"][0]["pose"]["position"]
        np.testing.assert_allclose(result.parts[0].T_scene_model[:3, 3], [position[axis] for axis in "xyz"])
        rotation = result.parts[0].T_scene_model[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
        self.assertAlmostEqual(np.linalg.det(rotation), 1)
        self.assertGreater(result.stats.total_seconds, 0)

    def test_what_scored_too_little_stands_apart_and_every_part_says_how_sure_it_is(self):
        params = binpose.v1.detection_service_pb2.DetectParams(min_score=0.6, max_rejected=4)
        result = self.client.detect("part", scan(), params=params)
        self.assertGreater(len(result.parts), 0)
        self.assertTrue(all(part.score >= 0.6 and 0 < part.confidence <= 1 for part in result.parts))
        self.assertTrue(1 <= len(result.rejected) <= 4 and all(part.score < 0.6 for part in result.rejected))

    def test_what_the_cell_knows_limits_the_search_and_every_pose_says_how_well_it_is_known(self):
        service = binpose.v1.detection_service_pb2
        best = self.client.detect("part", scan()).parts[0]
        self.assertEqual(best.covariance.shape, (6, 6))
        self.assertTrue((np.linalg.eigvalsh(best.covariance) > 0).all())
        self.assertEqual(best.free_directions.shape[1], 6)
        self.assertGreater(best.explained_area, 0.2)
        box = self.client.model("part")
        centre = [500 * (getattr(box.bounding_box_min, a) + getattr(box.bounding_box_max, a)) for a in "xyz"]  # mm
        region = service.OrientedBox()
        position = region.pose.position
        position.x, position.y, position.z = (best.T_scene_model @ [*centre, 1])[:3]
        region.size.x = region.size.y = region.size.z = 40
        params = service.DetectParams(regions=[region], list_equivalents=True)
        found = self.client.detect("part", scan(), params=params).parts
        np.testing.assert_allclose(found[0].T_scene_model[:3, 3], best.T_scene_model[:3, 3], atol=0.5)
        self.assertTrue(all(len(part.equivalents) == len(found[0].equivalents) for part in found))
        with self.assertRaisesRegex(binpose.BinposeError, "regions.size"):
            self.client.detect("part", scan(), params=service.DetectParams(regions=[service.OrientedBox()]))

    def test_metres_in_floats_and_organised_points_tell_the_same_scene(self):
        best = self.client.detect("part", scan()).parts[0]
        metres = scan((depth * camera["depth_unit_mm"] / 1000).astype(np.float32), scale=1.0, unit="m")
        np.testing.assert_allclose(1000 * self.client.detect("part", metres).parts[0].T_scene_model[:3, 3],
                                   best.T_scene_model[:3, 3], atol=0.5)
        points = binpose.points(cloud_of(depth), unit="mm")
        np.testing.assert_allclose(self.client.detect("part", points).parts[0].T_scene_model[:3, 3],
                                   best.T_scene_model[:3, 3], atol=0.5)

    def test_unordered_points_may_leave_out_what_was_not_measured(self):
        xyz = cloud_of(depth)
        result = self.client.detect("part", binpose.points(xyz[np.isfinite(xyz[..., 2])], unit="mm"))
        self.assertGreater(len(result.parts), 5)

    def test_many_scans_go_over_one_stream_in_order_and_a_bad_one_stops_none(self):
        empty = np.zeros((4, 4), np.uint16)
        results = list(self.client.detect_all(["part"], [scan(), scan(empty, fx=-1), scan()]))
        self.assertEqual(len(results[0].parts), len(results[2].parts))
        self.assertIsInstance(results[1], binpose.BinposeError)
        self.assertEqual(results[1].code, grpc.StatusCode.INVALID_ARGUMENT)
        self.assertIn("fx", str(results[1]))

    def test_nothing_found_is_a_result_with_a_reason(self):
        result = self.client.detect("part", scan(np.full((50, 50), 40000, np.uint16)))
        self.assertEqual(result.parts, ())
        self.assertTrue(result.warnings)

    def test_trains_lists_shows_and_deletes(self):
        stages = []
        model = self.client.train("brief", PART, unit="mm", on_progress=lambda stage, share: stages.append((stage, share)))
        self.assertAlmostEqual(model.diameter, 0.0794, places=3)
        self.assertEqual(stages[-1], ("TRAIN_STAGE_DONE", 1))
        self.assertEqual([m.id for m in self.client.models()], ["brief", "part"])
        self.assertEqual(self.client.model("brief").content_hash, model.content_hash)
        self.client.delete("brief")
        with self.assertRaises(binpose.BinposeError) as caught:
            self.client.model("brief")
        self.assertEqual(caught.exception.code, grpc.StatusCode.NOT_FOUND)
        self.assertIn("brief", str(caught.exception))

    def test_a_server_that_is_not_there_is_an_error(self):
        with binpose.Client("127.0.0.1:1") as client, self.assertRaises(binpose.BinposeError) as caught:
            client.models()
        self.assertEqual(caught.exception.code, grpc.StatusCode.UNAVAILABLE)

    def test_goes_on_to_the_next_server_where_one_is_gone(self):
        with binpose.Client(f"127.0.0.1:1,{server.address}") as client:
            self.assertGreater(len(client.detect("part", scan()).parts), 5)
        with binpose.Client(f"127.0.0.1:1, {server.address}") as client:
            self.assertEqual(client.model("part").id, "part")
        with binpose.Client(f"127.0.0.1:1,{server.address}", retries=0) as client, \
                self.assertRaises(binpose.BinposeError) as caught:
            client.detect("part", scan())
        self.assertEqual(caught.exception.code, grpc.StatusCode.UNAVAILABLE)

    def test_a_server_that_is_replaced_in_the_middle_of_a_stream_loses_no_scan(self):
        def scans():
            for number in range(6):
                if number == 3:
                    first.stop()
                yield scan()

        models = Path(directory.name) / "models"
        first = Server(models)
        with binpose.Client(f"{first.address},{server.address}") as client:
            results = list(client.detect_all("part", scans()))
        self.assertEqual([len(result.parts) for result in results], [len(results[0].parts)] * 6)

    def test_attempts_end_with_the_time_out_and_with_their_number(self):
        for options, call in [({"retries": 10**6}, {"timeout": 0.3}), ({"retries": 2}, {"timeout": 60})]:
            with binpose.Client("127.0.0.1:1", **options) as client, self.assertRaises(binpose.BinposeError) as caught:
                client.detect("part", scan(), **call)
            self.assertIn(caught.exception.code, [grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED])

    def test_wrong_arrays_and_units_are_refused_by_name(self):
        for message, call in [("unit", lambda: scan(unit="cm")),
                              ("depth", lambda: scan(depth[0])),
                              ("xyz", lambda: binpose.points(np.zeros((5, 2)), unit="m")),
                              ("normals", lambda: binpose.points(np.zeros((5, 3)), unit="m", normals=np.zeros((4, 3))))]:
            with self.assertRaisesRegex(ValueError, message):
                call()

    def test_a_scan_file_is_sent_as_it_is(self):
        file = Path(directory.name) / "scan.ply"
        file.write_bytes(b"ply\nnonsense")
        self.assertEqual(binpose.scan_file(file, unit="m").ply, b"ply\nnonsense")


class ExampleTest(unittest.TestCase):
    def run_example(self, scene):
        return subprocess.run(
            [sys.executable, PACKAGE / "examples/depth_to_robot.py", "--server", server.address, "--model", "part", "--scene",
             scene, "--cell", PACKAGE / "examples/cell.json"],
            env={**os.environ, "PYTHONPATH": str(built)}, capture_output=True, text=True, timeout=300)

    def test_the_target_is_where_a_true_part_is_taken_hold_of(self):
        run = self.run_example(SCENE)
        self.assertEqual(run.returncode, 0, run.stderr)
        target = np.array(json.loads(run.stdout)["T_base_grasp"])
        cell = {name: np.array(matrix) for name, matrix in json.loads((PACKAGE / "examples/cell.json").read_text()).items()}
        truth = [cell["T_base_camera"] @ np.reshape(instance["pose"], (4, 4)) @ cell["T_model_grasp"]
                 for instance in json.loads((SCENE / "gt.json").read_text())["instances"]]
        self.assertLess(min(np.linalg.norm(target[:3, 3] - T[:3, 3]) for T in truth), 2)

    def test_an_empty_bin_is_an_exit_with_a_reason(self):
        run = self.run_example(EMPTY)
        self.assertEqual(run.returncode, 1)
        self.assertIn("Nothing to take", run.stderr)


if __name__ == "__main__":
    unittest.main()
