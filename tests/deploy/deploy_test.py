"""What deploy/ configures, held to the server: its metrics, its options, and the tools that read these files."""

import json
import re
import subprocess
import tempfile
import unittest
import urllib.request
from pathlib import Path

import yaml
from binpose_process import BIN, Server

ROOT = Path(__file__).resolve().parents[2]
DEPLOY = ROOT / "deploy"
PART = ROOT / "tests/data/parts/bearing_support.stl"
SCENE = ROOT / "tests/data/scenes/bearing_support_01"
DASHBOARD = json.loads((DEPLOY / "grafana/binpose.json").read_text())

SELECTOR = re.compile(r"\b(binpose_\w+)(?:\{([^}]*)\})?")
MATCHER = re.compile(r'(\w+)\s*(=~|=)\s*"([^"]*)"')
FROM_PROMETHEUS = {"instance", "job"}  # labels that scraping adds


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, timeout=60, **options)


def dashboard_expressions():
    return [target["expr"] for panel in DASHBOARD["panels"] for target in panel["targets"]]


def alert_expressions():
    rules = yaml.safe_load((DEPLOY / "prometheus/alerts.yml").read_text())
    return [rule["expr"] for group in rules["groups"] for rule in group["rules"]]


class MetricsTest(unittest.TestCase):
    """Every metric and label value that the dashboard and the alerts ask for is one that the server exposes."""

    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as directory:
            server = Server(Path(directory) / "models")
            server.binpose_json("train", "--id", "part", "--mesh", PART, "--unit", "mm")
            server.binpose_json("detect", "--model", "part", "--scene", SCENE, "--unit", "mm")
            with urllib.request.urlopen(f"http://{server.metrics}/metrics", timeout=30) as page:
                cls.page = page.read().decode()
            server.stop()
        cls.series = {}  # metric -> label -> values
        for name, labels in re.findall(r"^(binpose_\w+)(?:\{(.*)\})? ", cls.page, re.MULTILINE):
            known = cls.series.setdefault(name, {})
            for label, value in re.findall(r'(\w+)="([^"]*)"', labels):
                known.setdefault(label, set()).add(value)

    def complaints(self, expression):
        for name, matchers in SELECTOR.findall(expression):
            if name not in self.series:
                yield f"{name} is not exposed"
                continue
            for label, operator, wanted in MATCHER.findall(matchers):
                if label in FROM_PROMETHEUS:
                    continue
                values = wanted.split("|") if operator == "=~" else [wanted]
                for value in set(values) - self.series[name].get(label, set()):
                    yield f"{name} has no {label}={value}"

    def test_the_dashboard_asks_for_what_is_exposed(self):
        self.assertGreater(len(dashboard_expressions()), 10)
        self.assertEqual([c for e in dashboard_expressions() for c in self.complaints(e)], [])
        self.assertEqual(list(self.complaints(DASHBOARD["templating"]["list"][0]["query"])), [])

    def test_the_alerts_ask_for_what_is_exposed(self):
        self.assertEqual([c for e in alert_expressions() for c in self.complaints(e)], [])

    def test_every_metric_is_on_the_dashboard(self):
        shown = {re.sub(r"_(bucket|sum|count)$", "", name)
                 for e in dashboard_expressions() for name, _ in SELECTOR.findall(e)}
        exposed = set(re.findall(r"^# TYPE (binpose_\w+)", self.page, re.MULTILINE))
        self.assertEqual(exposed - shown, set())

    def test_a_wrong_name_or_label_is_noticed(self):
        self.assertEqual(len(list(self.complaints('rate(binpose_nothing[5m]) + binpose_requests_total{code="NO"}'))), 2)

    def test_the_metrics_keep_the_conventions(self):
        check = run("promtool", "check", "metrics", input=self.page)
        self.assertEqual((check.returncode, check.stderr), (0, ""))


class PrometheusTest(unittest.TestCase):
    def test_configuration_and_rules_are_valid_and_the_alerts_fire_when_they_should(self):
        for command in [["check", "config", "prometheus.yml"], ["test", "rules", "alerts_test.yml"]]:
            check = run("promtool", *command, cwd=DEPLOY / "prometheus")
            self.assertEqual(check.returncode, 0, check.stdout + check.stderr)

    def test_every_alert_has_a_test_and_a_paragraph_in_the_run_book(self):
        tests = (DEPLOY / "prometheus/alerts_test.yml").read_text()
        book = (DEPLOY / "README.md").read_text()
        for name in re.findall(r"alert: (\w+)", (DEPLOY / "prometheus/alerts.yml").read_text()):
            self.assertIn(f"alertname: {name}\n        eval_time", tests, name)
            self.assertIn(f"**{name}**", book, name)

    def test_the_dashboard_is_made_of_valid_queries(self):
        expressions = [e.replace("$__rate_interval", "1m") for e in dashboard_expressions()]
        rules = {"groups": [{"name": "dashboard", "rules": [{"record": f"panel:{i}", "expr": e}
                                                           for i, e in enumerate(expressions)]}]}
        with tempfile.NamedTemporaryFile("w", suffix=".yml") as file:
            yaml.safe_dump(rules, file)
            file.flush()
            check = run("promtool", "check", "rules", file.name)
        self.assertEqual(check.returncode, 0, check.stdout + check.stderr)


class ComposeTest(unittest.TestCase):
    def test_what_it_mounts_is_there_and_what_it_names_exists(self):
        compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
        for name, service in compose["services"].items():
            for volume in service["volumes"]:
                source = volume.split(":")[0]
                there = (DEPLOY / source).exists() if source.startswith(".") else source in compose["volumes"]
                self.assertTrue(there, f"{name}: {source}")
            for port in service["ports"]:
                self.assertTrue(port.startswith("127.0.0.1:"), f"{name}: {port} is open to everyone")
        uid = yaml.safe_load((DEPLOY / "grafana/provisioning/datasources/prometheus.yaml").read_text())["datasources"][0]["uid"]
        for panel in DASHBOARD["panels"]:
            self.assertEqual(panel["datasource"]["uid"], uid)

    def test_prometheus_scrapes_where_the_image_serves_metrics(self):
        [target] = yaml.safe_load((DEPLOY / "prometheus/prometheus.yml").read_text())["scrape_configs"][0]["static_configs"][0]["targets"]
        port = target.split(":")[1]
        self.assertIn(f'"--metrics", "0.0.0.0:{port}"', (ROOT / "Dockerfile").read_text())

    def test_the_image_starts_the_server_with_options_that_it_knows(self):
        text = (ROOT / "Dockerfile").read_text()
        entry = json.loads(re.findall(r"^ENTRYPOINT (.*)$", text, re.MULTILINE)[-1])
        check = run(BIN / entry[0], *entry[1:], "--help")
        self.assertEqual(check.returncode, 0, check.stderr)
        health = json.loads(re.search(r"^HEALTHCHECK .* CMD (.*)$", text, re.MULTILINE)[1])
        with tempfile.TemporaryDirectory() as directory:
            server = Server(directory)
            self.addCleanup(server.stop)
            check = run(BIN / health[0], *health[1:], "--server", server.address)
            self.assertEqual((check.returncode, check.stdout), (0, "serving\n"))


class SystemdTest(unittest.TestCase):
    UNIT = DEPLOY / "systemd/binpose.service"

    def test_the_unit_is_valid(self):
        with tempfile.TemporaryDirectory() as directory:
            unit = Path(directory) / "binpose.service"
            unit.write_text(self.UNIT.read_text().replace("/usr/local/bin", str(BIN)))
            check = run("systemd-analyze", "verify", unit)
        self.assertEqual((check.returncode, check.stdout + check.stderr), (0, ""))

    def test_the_unit_is_locked_up_as_the_run_book_says(self):
        check = run("systemd-analyze", "security", "--offline=true", "--no-pager", self.UNIT)
        exposure = re.search(r"Overall exposure level for binpose.service: ([\d.]+)", check.stdout)[1]
        self.assertIn(f"exposure level {exposure}", (DEPLOY / "README.md").read_text())

    def test_the_unit_leaves_the_server_time_to_drain(self):
        help_text = run(BIN / "binpose-server", "--help").stdout
        drain = int(re.search(r"--drain-timeout [^\n=]*=(\d+)", help_text)[1])
        stop = int(re.search(r"TimeoutStopSec=(\d+)", self.UNIT.read_text())[1])
        self.assertGreater(stop, drain)


if __name__ == "__main__":
    unittest.main()
