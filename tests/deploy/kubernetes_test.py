"""deploy/kubernetes/ held to the API's schemas, offline, and to the server's own options and times."""

import json
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

import yaml
from binpose_process import BIN

ROOT = Path(__file__).resolve().parents[2]
KUBERNETES = ROOT / "deploy/kubernetes"
MODULES = BIN.parent / "node_modules"


def objects_of(folder):
    """What the files of a kustomization say, but for other kustomizations."""
    files = [folder / name for name in yaml.safe_load((folder / "kustomization.yaml").read_text())["resources"]]
    return [thing for file in files if file.is_file() for thing in yaml.safe_load_all(file.read_text())]


def complaints(things):
    check = subprocess.run(["node", Path(__file__).with_name("kubernetes.mjs"), MODULES], input=json.dumps(things),
                           capture_output=True, text=True, timeout=120)
    if check.returncode != 0:
        raise AssertionError(check.stderr)
    return json.loads(check.stdout)


class SchemaTest(unittest.TestCase):
    def test_every_object_is_what_the_api_takes(self):
        things = objects_of(KUBERNETES / "base") + objects_of(KUBERNETES / "plant")
        self.assertGreater(len(things), 7)
        self.assertEqual(complaints(things), [])

    def test_a_wrong_type_a_missing_and_an_unknown_field_are_noticed(self):
        [deployment] = [thing for thing in objects_of(KUBERNETES / "base") if thing["kind"] == "Deployment"]
        for field, value in [("replicas", "three"), ("selector", None), ("replica", 3)]:
            [complaint] = complaints([{**deployment, "spec": {**deployment["spec"], field: value}}])
            self.assertIn(field, complaint)

    @unittest.skipUnless(shutil.which("kubectl"), "kubectl, which knows kustomize, is not installed")
    def test_the_plant_as_kustomize_makes_it_is_what_the_api_takes(self):
        build = subprocess.run(["kubectl", "kustomize", KUBERNETES / "plant"], capture_output=True, text=True, timeout=120)
        self.assertEqual(build.returncode, 0, build.stderr)
        things = list(yaml.safe_load_all(build.stdout))
        self.assertEqual(complaints(things), [])
        [deployment] = [thing for thing in things if thing["kind"] == "Deployment"]
        self.assertEqual(deployment["spec"]["template"]["spec"]["containers"][0]["args"][:2], ["--threads", "4"])


class ServerTest(unittest.TestCase):
    def setUp(self):
        [deployment] = [thing for thing in objects_of(KUBERNETES / "base") if thing["kind"] == "Deployment"]
        self.pod = deployment["spec"]["template"]["spec"]
        self.container = self.pod["containers"][0]

    def test_the_server_knows_the_options(self):
        check = subprocess.run([BIN / "binpose-server", *self.container["args"], "--check-config"], capture_output=True,
                               text=True, timeout=120)
        self.assertEqual((check.returncode, check.stderr), (0, ""))

    def test_a_pod_is_given_the_time_that_its_drain_takes(self):
        arguments = self.container["args"]
        drain = int(arguments[arguments.index("--drain-timeout") + 1])
        pause = int(self.container["lifecycle"]["preStop"]["exec"]["command"][1])
        self.assertGreater(self.pod["terminationGracePeriodSeconds"], drain + pause + 5)

    def test_the_ports_are_those_of_the_image(self):
        image = (ROOT / "Dockerfile").read_text()
        for port in self.container["ports"]:
            self.assertIn(f"0.0.0.0:{port['containerPort']}", image)


if __name__ == "__main__":
    if not (MODULES / "kubernetes-models").exists() or not shutil.which("node"):
        print("kubernetes-models is not installed; tests/run.sh installs it from npm, where that can be reached.")
        sys.exit(77)
    unittest.main()
