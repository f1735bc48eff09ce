"""Adds the stubs of the wire API, generated from ../../proto, to the package when it is built.

Needs protoc and grpc_python_plugin: Debian's protobuf-compiler and protobuf-compiler-grpc.
"""

import shutil
import subprocess
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

PROTO = Path(__file__).resolve().parents[2] / "proto"


class BuildWithStubs(build_py):
    def run(self):
        super().run()
        plugin = shutil.which("grpc_python_plugin")
        if plugin is None or shutil.which("protoc") is None:
            raise SystemExit("protoc or grpc_python_plugin is missing: apt-get install protobuf-compiler "
                             "protobuf-compiler-grpc")
        files = [str(file.relative_to(PROTO)) for file in sorted(PROTO.glob("binpose/v1/*.proto"))]
        subprocess.run(["protoc", f"--proto_path={PROTO}", f"--python_out={self.build_lib}",
                        f"--grpc_python_out={self.build_lib}", f"--plugin=protoc-gen-grpc_python={plugin}", *files],
                       check=True)


# Under src/, so that a Python started here finds the package that was built, and not this one without its stubs.
setup(package_dir={"": "src"}, packages=["binpose"], cmdclass={"build_py": BuildWithStubs})
