"""What deploy/ configures, held to the server: its metrics, its options, and the tools that read these files."""

import itertools
import json
import re
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.error
import urllib.parse
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


class Image:
    """What the Dockerfile says of the server's image."""

    def __init__(self, text):
        self.entry = json.loads(re.findall(r"^ENTRYPOINT (.*)$", text, re.MULTILINE)[-1])
        self.health = json.loads(re.search(r"^HEALTHCHECK .* CMD (.*)$", text, re.MULTILINE)[1])
        self.environment = dict(re.findall(r"\b(BINPOSE_\w+)=(\S+)", text))


IMAGE = Image((ROOT / "Dockerfile").read_text())


class MetricsTest(unittest.TestCase):
    """Every metric and label value that the dashboard and the alerts ask for is one that the server exposes."""

    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as directory:
            server = Server(Path(directory) / "models")
            server.binpose_json("train", "--id", "part", "--mesh", PART, "--unit", "mm")
            server.binpose_json("detect", "--model", "part", "--scene", SCENE, "--unit", "mm")
            with urllib.request.urlopen(f"http://{server.metrics}/metrics", timeout=120) as page:
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


class GrafanaTest(unittest.TestCase):
    def test_panels_lie_beside_each_other_in_24_columns(self):
        taken = {}
        for panel in DASHBOARD["panels"]:
            place = panel["gridPos"]
            self.assertLessEqual(place["x"] + place["w"], 24, panel["title"])
            for cell in itertools.product(range(place["x"], place["x"] + place["w"]), range(place["y"], place["y"] + place["h"])):
                self.assertNotIn(cell, taken, f"{panel['title']} lies on {taken.get(cell)}")
                taken[cell] = panel["title"]

    def test_panels_and_their_queries_have_names_of_their_own(self):
        self.assertEqual(len({panel["id"] for panel in DASHBOARD["panels"]}), len(DASHBOARD["panels"]))
        for panel in DASHBOARD["panels"]:
            names = [target["refId"] for target in panel["targets"]]
            self.assertEqual(len(set(names)), len(names), panel["title"])


class Prometheus:
    """Debian's, configured as deploy/ says but for where the server is and for its patience."""

    def __init__(self, directory, target):
        config = yaml.safe_load((DEPLOY / "prometheus/prometheus.yml").read_text())
        config["global"] = {"scrape_interval": "1s", "evaluation_interval": "1s"}
        config["rule_files"] = [str(DEPLOY / "prometheus" / file) for file in config["rule_files"]]
        config["scrape_configs"][0]["static_configs"][0]["targets"] = [target]
        (directory / "prometheus.yml").write_text(yaml.safe_dump(config))
        with socket.create_server(("127.0.0.1", 0)) as free:
            self._address = f"127.0.0.1:{free.getsockname()[1]}"
        self._process = subprocess.Popen(
            ["prometheus", f"--config.file={directory}/prometheus.yml", f"--storage.tsdb.path={directory}/metrics",
             f"--web.listen-address={self._address}"], stderr=subprocess.DEVNULL)

    def get(self, path, **parameters):
        """The data of an answer; None while there is none."""
        try:
            url = f"http://{self._address}/api/v1/{path}?{urllib.parse.urlencode(parameters)}"
            with urllib.request.urlopen(url, timeout=120) as answer:
                return json.load(answer)["data"]
        except urllib.error.URLError:
            return None

    def values(self, expression):
        """Of each series its value now; none is the NaN of a mean over nothing."""
        series = (self.get("query", query=expression) or {"result": []})["result"]
        return [one["value"][1] for one in series if one["value"][1] != "NaN"]

    def stop(self):
        self._process.terminate()
        self._process.wait(60)


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.2)
    return condition()


class LivePrometheusTest(unittest.TestCase):
    """What compose.yaml brings up, but for Grafana: a server, scraped by Prometheus."""

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        models = Path(directory.name) / "models"
        models.mkdir()
        (models / "torn.model").write_bytes(b"torn")
        self.server = Server(models)
        self.addCleanup(self.server.stop)
        self.prometheus = Prometheus(Path(directory.name), self.server.metrics)
        self.addCleanup(self.prometheus.stop)

    def call_in_every_way(self):
        """A training, scans of which one is given up and one refused, and a look at the models."""
        self.server.binpose_json("train", "--id", "part", "--mesh", PART, "--unit", "mm")
        scan = ["detect", "--model", "part", "--scene", SCENE, "--unit", "mm"]
        self.server.binpose_json(*scan)
        self.server.binpose(*scan, "--timeout", "0.05")
        self.server.binpose(*scan, "--min-score", "2")
        self.server.binpose("models")

    def test_every_panel_of_the_dashboard_shows_data(self):
        self.assertTrue(wait_for(lambda: self.prometheus.values('up{job="binpose"} == 1')))
        expressions = [e.replace("$__rate_interval", "5m").replace("$instance", ".+") for e in dashboard_expressions()]
        end = time.monotonic() + 200
        empty = expressions
        while empty and time.monotonic() < end:
            self.call_in_every_way()
            empty = [e for e in empty if not self.prometheus.values(e)]
        self.assertEqual(empty, [])

    def test_the_alerts_are_evaluated_and_one_fires(self):
        names = set(re.findall(r"alert: (\w+)", (DEPLOY / "prometheus/alerts.yml").read_text()))
        rules = lambda: [rule for group in (self.prometheus.get("rules") or {"groups": []})["groups"]
                         for rule in group["rules"] if rule["health"] == "ok"]
        self.assertTrue(wait_for(lambda: {rule["name"] for rule in rules()} == names), rules())
        firing = lambda: [alert["labels"]["alertname"] for alert in self.prometheus.get("alerts")["alerts"]
                          if alert["state"] == "firing"]
        self.assertTrue(wait_for(lambda: firing() == ["BinposeModelLost"]), firing())


class ComposeTest(unittest.TestCase):
    def test_it_is_what_compose_takes(self):
        for change, known in [(("", ""), True), (("ports:", "port:"), False), (("  metrics: {}", ""), False)]:
            text = (DEPLOY / "compose.yaml").read_text().replace(*change)
            check = run("docker-compose", "--file", "-", "config", "--quiet", input=text, cwd=DEPLOY)
            self.assertEqual(check.returncode == 0, known, check.stderr)

    def test_grafana_finds_its_dashboard_and_prometheus(self):
        services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]
        mounts = dict(volume.split(":")[:2] for volume in services["grafana"]["volumes"])
        [provider] = yaml.safe_load((DEPLOY / "grafana/provisioning/dashboards/binpose.yaml").read_text())["providers"]
        self.assertEqual(mounts["./grafana/binpose.json"], f"{provider['options']['path']}/binpose.json")
        [source] = yaml.safe_load((DEPLOY / "grafana/provisioning/datasources/prometheus.yaml").read_text())["datasources"]
        host, port = source["url"].removeprefix("http://").split(":")
        self.assertEqual(services[host]["ports"], [f"127.0.0.1:{port}:{port}"])

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
        self.assertEqual(IMAGE.environment["BINPOSE_METRICS"], f"0.0.0.0:{port}")

    def test_the_image_starts_the_server_with_options_that_it_knows(self):
        check = run(BIN / IMAGE.entry[0], *IMAGE.entry[1:], "--check-config", env=IMAGE.environment)
        self.assertEqual((check.returncode, check.stderr), (0, ""))
        shown = run(BIN / IMAGE.entry[0], "--print-config", env=IMAGE.environment).stdout
        for name, value in IMAGE.environment.items():
            option = name.removeprefix("BINPOSE_").lower().replace("_", "-")
            self.assertRegex(shown, rf'(?m)^{option}="?{re.escape(value)}"?$')

    def test_the_image_is_healthy_while_its_server_is_ready(self):
        with tempfile.TemporaryDirectory() as directory:
            server = Server(directory)
            environment = {**IMAGE.environment, "BINPOSE_METRICS": f"0.0.0.0:{server.metrics.split(':')[1]}"}
            healthy = run(BIN / IMAGE.health[0], *IMAGE.health[1:], env=environment)
            server.stop()
            ended = run(BIN / IMAGE.health[0], *IMAGE.health[1:], env=environment)
        self.assertEqual((healthy.returncode, healthy.stderr), (0, ""))
        self.assertEqual(ended.returncode, 1)
        self.assertIn("Nothing answers", ended.stderr)


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
