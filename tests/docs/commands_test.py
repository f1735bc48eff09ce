"""Every command that the documents show is run, in order, as they show it.

Each document has a folder with the files that it speaks of. A command that cannot run here stands in NOT_HERE, with the
reason; one that is neither run nor listed there fails the test.
"""

import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import console
from binpose_process import BIN, Server

ROOT = Path(__file__).resolve().parents[2]
PART = ROOT / "tests/data/parts/bearing_support.stl"
SCENE = ROOT / "tests/data/scenes/bearing_support_01"
BUF = BIN.parent / "node_modules/.bin"

NOT_HERE = [
    (r"deploy/quickstart\.sh|tests/run\.sh", "builds everything; tests/fresh_debian.sh runs it"),
    (r"deploy/install-packages\.sh|^cmake ", "has been done: this very build"),
    (r"docker ", "needs an engine"),
    (r"sudo ", "changes the machine"),
]
# Words that stand for the reader's own, within a sentence.
FILLED_IN = {"...": "--model bracket --scene scan.ply --unit mm", " ID": " bracket", "HOST:PORT": "$BINPOSE_SERVER"}
# What the documents call it -> what it is here.
SAME_SERVER = "localhost:50051"


def depth_points():
    """The sample scene's points, millimetres."""
    import numpy as np
    from PIL import Image
    camera = json.loads((SCENE / "camera.json").read_text())
    z = np.asarray(Image.open(SCENE / "depth.png")).astype(float) * camera["depth_unit_mm"]
    v, u = np.indices(z.shape)
    xyz = np.dstack([(u - camera["cx"]) * z / camera["fx"], (v - camera["cy"]) * z / camera["fy"], z])
    return xyz[z > 0].astype("<f4")


def write_samples(folder):
    xyz = depth_points()
    count = len(xyz)
    for mesh in ["gear.stl", "bracket.stl"]:
        shutil.copy(PART, folder / mesh)
    (folder / "scans").mkdir()
    ply = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n" + "".join(
        f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    pcd = (f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\n"
           f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n")
    for name, head in [("bin.ply", ply), ("scan.ply", ply), ("scans/1.ply", ply), ("bin.pcd", pcd)]:
        (folder / name).write_bytes(head.encode() + xyz.tobytes())
    for link in ["tests", "deploy", "client", "proto"]:
        (folder / link).symlink_to(ROOT / link)


class CommandsTest(unittest.TestCase):
    """One test a document."""

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.folder = Path(directory.name)
        write_samples(self.folder)
        self.server = Server(self.folder / "models")
        self.addCleanup(self.server.stop)
        standins = [] if shutil.which("grpcurl") else [str(ROOT / "tests/docs/standins")]
        path = [str(BIN), *standins, str(BUF), str(Path(sys.executable).parent), os.environ["PATH"]]
        self.environment = {**os.environ, "PATH": ":".join(path), "BINPOSE_SERVER": self.server.address}

    def run_document(self, name):
        text = (ROOT / name).read_text()
        steps = [*console.steps_of(text), *map(self.fill_in, console.inline_steps_of(text))]
        self.assertGreater(len(steps), 0, f"{name} shows no command")
        for step in steps:
            if not any(re.search(pattern, step.command) for pattern, _ in NOT_HERE):
                with self.subTest(document=name, line=step.line, command=step.command):
                    self.run_step(step)

    def fill_in(self, step):
        """A command of a sentence as one that can be run: a bare name is looked up in its help."""
        command = step.command
        for word, meaning in FILLED_IN.items():
            command = command.replace(word, meaning)
        if len(command.split()) == 2 and not command.endswith("--help"):
            command += " --help"
        if command.startswith("binpose watch"):
            command += " --existing --count 1"
        return console.Step(step.line, command, [])

    def run_step(self, step):
        command = step.command.replace(SAME_SERVER, self.environment["BINPOSE_SERVER"]).replace("localhost:9464", self.server.metrics)
        if re.match(r"binpose-server .*&$", command):
            return self.run_server(command)
        exported = re.match(r"export (\w+)=(\S+)$", command)
        if exported:
            self.environment[exported[1]] = exported[2]
            return None
        run = subprocess.run(["bash", "-c", command], cwd=self.folder, env=self.environment, text=True, timeout=300,
                             stdin=subprocess.DEVNULL, capture_output=True)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        self.assertIsNone(console.missing(step.output, run.stdout + run.stderr), run.stdout + run.stderr)
        return None

    def run_server(self, command):
        """A server that the document starts: the same command on free ports."""
        words = command.removesuffix("&").split()
        process = subprocess.Popen([*words, "--listen", "127.0.0.1:0", "--metrics", "127.0.0.1:0"], cwd=self.folder,
                                   env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait, 60)
        self.addCleanup(process.terminate)
        address = process.stdout.readline().split(", ")[0].removeprefix("listening on ")
        self.assertRegex(address, r":\d+$")
        self.environment["BINPOSE_SERVER"] = address

    def need_buf(self):
        if shutil.which("grpcurl") is None and not (BUF / "buf").exists():
            self.skipTest("neither grpcurl nor buf is installed; tests/run.sh installs buf from npm")

    def test_readme(self):
        self.need_buf()
        self.run_document("README.md")

    def test_run_book(self):
        self.run_document("deploy/README.md")

    def test_grpcurl_cookbook(self):
        self.need_buf()
        self.run_document("client/grpcurl.md")

    def test_python(self):
        self.server.binpose_json("train", "--id", "bearing_support", "--mesh", PART, "--unit", "mm")
        # Its commands write into the folder that they run in: a copy.
        tree = self.folder / "tree"
        for name in ["client/python", "proto", "tests/data"]:
            shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("*.egg-info", "build"))
        for name in ["gear.stl", "bin.ply"]:
            shutil.copy(self.folder / name, tree / "client/python")
        self.folder = tree / "client/python"
        self.run_document("client/python/README.md")
        [code] = console.blocks_of((ROOT / "client/python/README.md").read_text(), "python")
        self.run_step(console.Step(0, f"python3 - <<'END'\n{code}END\n", []))

    def test_the_example_that_the_readme_shows_is_the_one_that_works(self):
        self.assertIn((ROOT / "client/example.cpp").read_text(), (ROOT / "README.md").read_text())
        run = subprocess.run([BIN / "example", self.server.address, "gear.stl", "scan.ply"], cwd=self.folder, text=True,
                             capture_output=True, timeout=300)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertRegex(run.stdout, r"^0\.\d+: -?\d")


class CoverageTest(unittest.TestCase):
    """Nothing that a document shows is left out in silence."""

    def setUp(self):
        names = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        self.documents = {name: (ROOT / name).read_text() for name in names.split()}

    def test_every_document_with_commands_has_a_test(self):
        tests = re.findall(r'run_document\("(.*)"\)', Path(__file__).read_text())
        self.assertEqual({name for name, text in self.documents.items() if console.steps_of(text)}, set(tests))

    def test_the_quickstart_goes_through_the_steps_that_the_readme_shows(self):
        script = (ROOT / "deploy/quickstart.sh").read_text()
        steps = [text.replace("$part", "bearing_support") for text in re.findall(r'^heading "(.*)"', script, re.MULTILINE)]
        [shown] = [step.output for step in console.steps_of(self.documents["README.md"]) if "quickstart" in step.command]
        self.assertEqual([line.removeprefix("== ") for line in shown if line.startswith("== ")], steps)

    def test_every_reason_not_to_run_a_command_is_needed(self):
        commands = [step.command for text in self.documents.values() for step in console.steps_of(text)]
        for pattern, _ in NOT_HERE:
            self.assertTrue(any(re.search(pattern, command) for command in commands), pattern)

    def test_options_named_in_a_sentence_exist(self):
        known = subprocess.run([BIN / "binpose-server", "--help"], capture_output=True, text=True, check=True).stdout
        commands = re.findall(r"^  (\w+) ", Server.help("--help").split("Subcommands:")[1], re.MULTILINE)
        known += "".join(map(Server.help, commands))
        for name in ["README.md", "deploy/README.md", "client/grpcurl.md", "proto/README.md"]:
            for option in re.findall(r"`[^`\n]*?(--[a-z][\w-]*)", self.documents[name]):
                if not re.search(rf"`docker[^`]*{option}", self.documents[name]):
                    self.assertRegex(known, rf"{option}\b", name)


class ConsoleTest(unittest.TestCase):
    TEXT = "text\n```console\n$ one \\\n    two\n  12 ms\n...\n$ three\n```\n```python\n$ no\n```\n"

    def test_reads_commands_and_what_they_print(self):
        steps = console.steps_of(self.TEXT)
        self.assertEqual([step.command for step in steps], ["one two", "three"])
        self.assertEqual(steps[0].output, ["  12 ms", "..."])

    def test_reads_commands_in_sentences_and_blocks_of_code(self):
        self.assertEqual([step.command for step in console.inline_steps_of("`binpose a`\n or `binpose`, `binpose b --c`")],
                         ["binpose a", "binpose b --c"])
        self.assertEqual(console.blocks_of(self.TEXT, "python"), ["$ no\n"])

    def test_numbers_may_differ_and_words_may_not(self):
        self.assertIsNone(console.missing(["found in 12.5 ms", "...", "done"], "found in  7 ms\nmore\ndone\n"))
        self.assertEqual(console.missing(["found in 12 s"], "found in 12 ms\n"), "found in 12 s")
        self.assertEqual(console.missing(["b", "a"], "a\nb\n"), "a")


if __name__ == "__main__":
    unittest.main()
