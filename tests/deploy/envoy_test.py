"""deploy/envoy/ held to Envoy's own definitions: every field and every type that it names exists."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml
from binpose_process import BIN
from google.protobuf import descriptor_pb2, descriptor_pool, json_format, message_factory

CONFIG = Path(__file__).resolve().parents[2] / "deploy/envoy/envoy.yaml"
APIS = BIN.parent / "node_modules/@grpc/grpc-js-xds/deps"
FOLDERS = [APIS / name for name in ["envoy-api", "xds", "googleapis"]]
FILES = ["envoy/config/bootstrap/v3/bootstrap.proto",
         "envoy/extensions/filters/http/router/v3/router.proto",
         "envoy/extensions/filters/network/http_connection_manager/v3/http_connection_manager.proto",
         "envoy/extensions/transport_sockets/tls/v3/tls.proto",
         "envoy/extensions/upstreams/http/v3/http_protocol_options.proto"]


def load_definitions():
    with tempfile.TemporaryDirectory() as folder:
        # The package's validate.proto is older than the files that use it.
        rules = (APIS / "protoc-gen-validate/validate/validate.proto").read_text()
        rules = rules.replace("message StringRules {", "message StringRules { optional bool ignore_empty = 26;")
        (Path(folder) / "validate").mkdir()
        (Path(folder) / "validate/validate.proto").write_text(rules)
        run = subprocess.run(["protoc", *(f"--proto_path={path}" for path in [folder, *FOLDERS]), "--include_imports",
                              f"--descriptor_set_out={folder}/all", *FILES], capture_output=True, text=True)
        if run.returncode != 0:
            raise AssertionError(run.stderr)
        files = descriptor_pb2.FileDescriptorSet.FromString((Path(folder) / "all").read_bytes())
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return pool


class EnvoyTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pool = load_definitions()
        descriptor = cls.pool.FindMessageTypeByName("envoy.config.bootstrap.v3.Bootstrap")
        cls.bootstrap = message_factory.MessageFactory(cls.pool).GetPrototype(descriptor)

    def parse(self, config):
        return json_format.ParseDict(config, self.bootstrap(), descriptor_pool=self.pool)

    def test_every_field_exists(self):
        config = yaml.safe_load(CONFIG.read_text())
        self.assertEqual(self.parse(config).static_resources.clusters[0].name, "servers")

    def test_with_tls_too(self):
        lines = CONFIG.read_text().splitlines()
        start = next(i for i, line in enumerate(lines) if "# transport_socket:" in line)
        tls = yaml.safe_load("\n".join(line.strip().removeprefix("# ") for line in lines[start:]
                                       if line.strip().startswith("# ")))
        config = yaml.safe_load(CONFIG.read_text())
        config["static_resources"]["clusters"][0].update(tls)
        self.assertTrue(self.parse(config).static_resources.clusters[0].transport_socket.name)

    def test_a_field_that_does_not_exist_is_noticed(self):
        config = yaml.safe_load(CONFIG.read_text())
        config["static_resources"]["clusters"][0]["health_checks"][0]["http_health_check"]["pathh"] = "/"
        with self.assertRaises(json_format.ParseError):
            self.parse(config)


if __name__ == "__main__":
    if not APIS.exists():
        print("@grpc/grpc-js-xds, with Envoy's definitions, is not installed; tests/run.sh installs it from npm.")
        sys.exit(77)
    unittest.main()
