"""The one-way rule of the source tree: client -> proto <- server -> core, and core knows no transport and no log.

Every #include and proto import of the four folders is read. The rule itself is tested below on trees that break it.
"""

import re
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

FOLDERS = {"core", "proto", "server", "client"}
MAY_INCLUDE = {
    "core": {"core"},
    "proto": set(),
    "server": {"server", "core", "proto"},
    "client": {"client", "proto"},
}
# Libraries that would give core a transport, a log or a voice of its own.
CORE_MUST_NOT_KNOW = {"grpc", "grpcpp", "google", "spdlog", "prometheus", "iostream"}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
IMPORT = re.compile(r'^\s*import\s+(?:public\s+|weak\s+)?"([^"]+)"', re.MULTILINE)


def violations(root):
    """One sentence per include below `root` that breaks the rule."""
    found = []
    for folder in sorted(FOLDERS):
        for file in sorted((root / folder).rglob("*")):
            where = file.relative_to(root)
            if file.suffix in {".h", ".cpp"}:
                for quote, name in INCLUDE.findall(file.read_text()):
                    found += [f"{where}: {text}" for text in include_violations(folder, quote, name)]
            elif file.suffix == ".proto":
                for name in IMPORT.findall(file.read_text()):
                    if not name.startswith(("binpose/", "google/protobuf/")):
                        found.append(f"{where}: proto must not import {name}")
    return found


def include_violations(folder, quote, name):
    top = name.split("/")[0]
    if top == "binpose":  # generated from proto/
        top = "proto"
    if quote == '"' and ("/" not in name or top.startswith(".")):
        yield f'write "{name}" from the project root'
    elif top in FOLDERS and top not in MAY_INCLUDE[folder]:
        yield f"{folder} must not include {name}"
    elif folder == "core" and top in CORE_MUST_NOT_KNOW:
        yield f"core must not include {name}"


class DependenciesTest(unittest.TestCase):
    def check(self, path, content):
        with tempfile.TemporaryDirectory() as directory:
            file = Path(directory) / path
            file.parent.mkdir(parents=True)
            file.write_text(content)
            return violations(Path(directory))

    def test_this_tree_keeps_the_rule(self):
        self.assertEqual(violations(ROOT), [])

    def test_this_tree_is_read_at_all(self):
        for folder in FOLDERS:
            self.assertTrue((ROOT / folder).is_dir(), folder)

    def test_core_may_include_neither_transport_nor_log_nor_its_users(self):
        for name in ["<grpcpp/grpcpp.h>", "<google/protobuf/message.h>", "<spdlog/spdlog.h>", "<prometheus/counter.h>",
                     "<iostream>", '"server/config.h"', '"client/client.h"', '"binpose/v1/types.pb.h"']:
            self.assertEqual(len(self.check("core/detect/bad.cpp", f"#include {name}\n")), 1, name)

    def test_client_may_include_neither_core_nor_server(self):
        self.assertEqual(len(self.check("client/cli/bad.h", '#include "core/params.h"\n')), 1)
        self.assertEqual(len(self.check("client/cli/bad.h", '  #  include "server/config.h"\n')), 1)

    def test_server_may_not_include_client(self):
        self.assertEqual(len(self.check("server/bad.cpp", '#include "client/client.h"\n')), 1)

    def test_proto_may_import_only_itself_and_the_well_known_types(self):
        self.assertEqual(len(self.check("proto/binpose/v1/bad.proto", 'import "google/rpc/status.proto";\n')), 1)

    def test_includes_are_written_from_the_project_root(self):
        self.assertEqual(len(self.check("core/bad.cpp", '#include "../core/params.h"\n')), 1)
        self.assertEqual(len(self.check("core/bad.cpp", '#include "params.h"\n')), 1)

    def test_allowed_includes_pass(self):
        self.assertEqual(self.check("core/a.cpp", '#include <vector>\n#include "core/params.h"\n'), [])
        self.assertEqual(self.check("server/a.cpp", '#include "core/params.h"\n#include "binpose/v1/a.pb.h"\n'), [])
        self.assertEqual(self.check("client/a.cpp", '#include <grpcpp/channel.h>\n#include "client/client.h"\n'), [])


if __name__ == "__main__":
    unittest.main()
