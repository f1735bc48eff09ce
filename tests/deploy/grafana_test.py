"""deploy/grafana/ held to Grafana's own types, those of the very version that compose.yaml starts."""

import copy
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml
from binpose_process import BIN

ROOT = Path(__file__).resolve().parents[2]
DEPLOY = ROOT / "deploy"
MODULES = BIN.parent / "node_modules"
DASHBOARD = json.loads((DEPLOY / "grafana/binpose.json").read_text())


def complaints(*dashboards):
    """For each dashboard what the compiler of TypeScript finds, one line a finding."""
    types = Path(__file__).with_name("dashboard.ts").read_text()
    with tempfile.TemporaryDirectory(dir=MODULES.parent) as directory:
        names = [f"{directory}/{number}.ts" for number in range(len(dashboards))]
        for name, dashboard in zip(names, dashboards):
            Path(name).write_text(types + json.dumps(dashboard, indent=1))
        check = subprocess.run([MODULES / ".bin/tsc", "--noEmit", "--strict", "--skipLibCheck", "--module", "nodenext", *names],
                               capture_output=True, text=True, timeout=300)
        found = [line for line in check.stdout.splitlines() if ": error " in line]
        if (check.returncode == 0) != (not found):
            raise AssertionError(check.stdout + check.stderr)
        return [[line for line in found if f"/{number}.ts(" in f"/{line}"] for number in range(len(dashboards))]


class DashboardTest(unittest.TestCase):
    def test_it_is_what_grafana_takes(self):
        self.assertEqual(complaints(DASHBOARD), [[]])

    def test_unknown_fields_wrong_values_and_missing_ones_are_noticed(self):
        curve = next(i for i, panel in enumerate(DASHBOARD["panels"]) if "stacking" in panel["fieldConfig"]["defaults"].get("custom", {}))
        changes = {
            "fillopacity": lambda d: d["panels"][curve]["fieldConfig"]["defaults"]["custom"].update(fillopacity=1),
            "stack": lambda d: d["panels"][curve]["fieldConfig"]["defaults"]["custom"]["stacking"].update(mode="stack"),
            "graph": lambda d: d["panels"][0].update(type="graph"),
            "units": lambda d: d["panels"][0]["fieldConfig"]["defaults"].update(units="s"),
            "expression": lambda d: d["panels"][0]["targets"][0].update(expression="up"),
            "refId": lambda d: d["panels"][0]["targets"][0].pop("refId"),
            "string": lambda d: d["panels"][0]["gridPos"].update(w="6"),
            "Variable": lambda d: d["templating"]["list"][0].update(refresh=9),
            "schemaversion": lambda d: d.update(schemaversion=39),
        }
        wrong = [copy.deepcopy(DASHBOARD) for _ in changes]
        for dashboard, change in zip(wrong, changes.values()):
            change(dashboard)
        for word, found in zip(changes, complaints(*wrong)):
            self.assertEqual(len(found), 1, f"{word}: {found}")
            self.assertIn(word, found[0])


class VersionTest(unittest.TestCase):
    def test_the_types_are_those_of_the_image(self):
        image = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]["grafana"]["image"]
        schema = json.loads((ROOT / "tests/lint/package.json").read_text())["dependencies"]["@grafana/schema"]
        self.assertEqual(image, f"grafana/grafana:{schema}")


if __name__ == "__main__":
    if not (MODULES / "@grafana/schema").exists():
        print("@grafana/schema is not installed; tests/run.sh installs it from npm, where that can be reached.")
        sys.exit(77)
    unittest.main()
