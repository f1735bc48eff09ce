"""What deploy/quickstart.sh shows, and what a cell does next, through real processes."""

import json
import math
import tempfile
import unittest
import urllib.request
from pathlib import Path

from binpose_process import Server

DATA = Path(__file__).resolve().parents[1] / "data"
PART = DATA / "parts/bearing_support.stl"
SCENE = DATA / "scenes/bearing_support_01"


def centre_of(model):
    """Centre of the model's bounding box, millimetres; hardly moved by the symmetries of a part."""
    low, high = model["boundingBoxMin"], model["boundingBoxMax"]
    return [500 * (low.get(axis, 0) + high.get(axis, 0)) for axis in "xyz"]


def moved(pose, point):
    """A point through a pose of the API: quaternion and position."""
    q, p = pose["orientation"], pose["position"]
    x, y, z, w = (q.get(name, 0) for name in "xyzw")
    rotation = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return [sum(r * c for r, c in zip(row, point)) + p.get(axis, 0) for row, axis in zip(rotation, "xyz")]


def moved_by_matrix(matrix, point):
    """A point through a pose of gt.json: 16 numbers, row by row."""
    return [sum(matrix[4 * row + i] * point[i] for i in range(3)) + matrix[4 * row + 3] for row in range(3)]


class QuickstartTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = tempfile.TemporaryDirectory()
        cls.server = Server(cls.directory.name)
        [cls.model] = cls.server.binpose_json("train", "--id", "part", "--mesh", PART, "--unit", "mm")

    @classmethod
    def tearDownClass(cls):
        cls.server.stop()
        cls.directory.cleanup()

    def test_the_best_pose_is_a_true_one(self):
        [answer] = self.server.binpose_json("detect", "--model", "part", "--scene", SCENE, "--unit", "mm")
        best = answer["hypotheses"][0]
        self.assertEqual(best["modelId"], "part")
        centre = centre_of(self.model)
        truth = json.loads((SCENE / "gt.json").read_text())["instances"]
        error = min(math.dist(moved(best["pose"], centre), moved_by_matrix(instance["pose"], centre))
                    for instance in truth)
        self.assertLess(error, 1000 * 0.05 * self.model["diameter"])

    def test_several_scenes_are_answered_in_order(self):
        scenes = [DATA / "scenes" / name for name in ["bearing_support_02", "empty_bin_01", "bearing_support_03"]]
        answers = self.server.binpose_json("detect", "--model", "part", "--scene", *scenes, "--unit", "mm")
        self.assertEqual([answer["requestId"] for answer in answers], [str(scene) for scene in scenes])
        self.assertEqual([bool(answer["hypotheses"]) for answer in answers], [True, False, True])

    def test_the_table_names_pose_score_and_time(self):
        run = self.server.binpose("detect", "--model", "part", "--scene", SCENE, "--unit", "mm")
        self.assertEqual(run.returncode, 0, run.stderr)
        for word in ["score", "visible", "ms"]:
            self.assertIn(word, run.stdout.lower())

    def test_an_unknown_model_is_named(self):
        run = self.server.binpose("detect", "--model", "ghost", "--scene", SCENE, "--unit", "mm")
        self.assertNotEqual(run.returncode, 0)
        self.assertIn("ghost", run.stderr)

    def test_a_deleted_model_is_gone(self):
        self.server.binpose_json("train", "--id", "brief", "--mesh", PART, "--unit", "mm")
        self.assertEqual(self.server.binpose("delete", "brief").returncode, 0)
        self.assertNotIn("brief", self.server.binpose("models").stdout)
        self.assertNotEqual(self.server.binpose("delete", "brief").returncode, 0)

    def test_a_request_is_one_line_of_json_for_grpcurl(self):
        run = self.server.binpose("request", "--model", "part", "--scene", SCENE, "--unit", "mm")
        self.assertEqual(run.stdout.count("\n"), 1)
        request = json.loads(run.stdout)
        self.assertEqual(request["modelIds"], ["part"])
        self.assertEqual(request["cloud"]["unit"], "LENGTH_UNIT_MILLIMETRE")

    def test_calls_are_counted(self):
        with urllib.request.urlopen(f"http://{self.server.metrics}/metrics", timeout=120) as page:
            self.assertIn("Train", page.read().decode())


class RestartTest(unittest.TestCase):
    def test_models_outlive_the_server(self):
        with tempfile.TemporaryDirectory() as directory:
            server = Server(directory)
            [trained] = server.binpose_json("train", "--id", "part", "--mesh", PART, "--unit", "mm")
            self.assertEqual(server.stop(), 0)
            server = Server(directory)
            self.assertEqual(server.binpose_json("models"), [{"models": [trained]}])
            self.assertEqual(server.stop(), 0)


if __name__ == "__main__":
    unittest.main()
