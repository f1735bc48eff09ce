"""The promise of proto/README.md: within v1 fields are only added. Held by `buf breaking` against the last tag.

Usage: breaking_test.py NODE_MODULES, the folder that tests/run.sh installed buf into.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NOT_INSTALLED = 77  # for ctest: skipped
A_NEW_FIELD = ("  double diameter = 2;", "  double diameter = 2;\n  double weight = 99;")


def breaking(now, before):
    """What `buf breaking` finds; empty if nothing breaks."""
    return subprocess.run([BUF, "breaking", now, "--against", before], cwd=ROOT, capture_output=True, text=True).stdout


def git(repository, *arguments):
    return subprocess.run(["git", "-C", repository, *arguments], capture_output=True, check=False)


def proto_of_last_tag(repository, folder):
    """Unpacks proto/ as it was at the last tag before HEAD; None if there is no tag."""
    tag = git(repository, "describe", "--tags", "--abbrev=0")
    if tag.returncode != 0:
        return None
    archive = git(repository, "archive", "--format=tar", tag.stdout.decode().strip(), "proto")
    subprocess.run(["tar", "-x", "-C", folder], input=archive.stdout, check=True)
    return Path(folder) / "proto"


class BreakingTest(unittest.TestCase):
    def folder(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        return Path(directory.name)

    def changed(self, pattern, replacement):
        """A copy of proto/ with one change in its model service."""
        copy = self.folder() / "proto"
        shutil.copytree(ROOT / "proto", copy)
        file = copy / "binpose/v1/model_service.proto"
        text, count = re.subn(pattern, replacement, file.read_text(), count=1)
        self.assertEqual(count, 1)
        file.write_text(text)
        return copy

    def test_nothing_breaks_since_the_last_tag(self):
        before = proto_of_last_tag(ROOT, self.folder())
        if before is None:
            self.skipTest("this clone has no tag: either nothing was promised yet, or the tags were not fetched")
        self.assertEqual(breaking("proto", before), "")

    def test_what_counts_is_the_last_tag_not_the_last_commit(self):
        repository = self.folder()
        shutil.copytree(ROOT / "proto", repository / "proto")
        git(repository, "init", "--quiet")
        self.assertIsNone(proto_of_last_tag(repository, self.folder()))
        identity = ["-c", "user.name=test", "-c", "user.email=test@localhost"]
        git(repository, "add", "proto")
        git(repository, *identity, "commit", "--quiet", "--message", "first")
        git(repository, *identity, "tag", "--annotate", "v1", "--message", "first")
        shutil.rmtree(repository / "proto")
        shutil.copytree(self.changed(r"  double diameter = 2;\n", ""), repository / "proto")
        git(repository, *identity, "commit", "--all", "--quiet", "--message", "second")
        before = proto_of_last_tag(repository, self.folder())
        self.assertIn("diameter", breaking(repository / "proto", before))
        self.assertEqual(breaking("proto", before), "")
        self.assertEqual(breaking(self.changed(*A_NEW_FIELD), before), "")

    def test_a_field_that_goes_or_changes_is_noticed(self):
        for change in ["", "  float diameter = 2;\n", "  double size = 2;\n", "  double diameter = 98;\n"]:
            with self.subTest(change or "gone"):
                self.assertIn("diameter", breaking(self.changed(r"  double diameter = 2;\n", change), "proto"))

    def test_a_new_field_breaks_nothing(self):
        self.assertEqual(breaking(self.changed(*A_NEW_FIELD), "proto"), "")


if __name__ == "__main__":
    BUF = Path(sys.argv.pop(1)) / ".bin/buf"
    if not BUF.exists():
        print("buf is not installed; tests/run.sh installs it from npm.")
        sys.exit(NOT_INSTALLED)
    unittest.main()
