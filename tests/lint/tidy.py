"""clang-tidy over every source of the project in a build's compile_commands.json.

Where CMake joins sources to be compiled at once (CMAKE_UNITY_BUILD) they are read at once too, which reads gRPC and
Eigen once for all of them. What passed is not read again until one of its files, a header of ours, the compile command or
.clang-tidy changes; the stamps lie in the build directory.

Usage: tidy.py BUILD_DIR
"""

import hashlib
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def includes_of(build):
    """Object file -> the project's own files that went into it, from Ninja's log of dependencies."""
    log = subprocess.run(["ninja", "-C", build, "-t", "deps"], capture_output=True, text=True, check=True).stdout
    files, current = {}, None
    for line in log.splitlines():
        if line.startswith("    "):
            path = (build / line.strip()).resolve()
            if path.is_relative_to(ROOT):
                files[current].append(path)
        elif ": #deps" in line:
            current = line.split(": #deps")[0]
            files[current] = []
    return files


def object_of(entry):
    return entry["command"].split(" -o ")[1].split()[0]


def sources_of(entry):
    """The project's sources that are compiled by a command: one, or those that a unity file includes."""
    file = Path(entry["file"])
    if "Unity" not in file.parts:
        return [file]
    return [Path(path) for path in re.findall(r'#include "(.+)"', file.read_text())]


def fingerprint(entry, files):
    sources = sources_of(entry)
    digest = hashlib.sha256(entry["command"].encode())
    rules = [folder / ".clang-tidy" for folder in sources[0].parents if folder.is_relative_to(ROOT)]
    for file in [*rules, *sources, *sorted(files)]:
        digest.update(file.read_bytes() if file.exists() else b"")
    return digest.hexdigest()


def tidy(build, entry, files):
    """What clang-tidy found in the sources of one command; empty if they are clean."""
    name = str(Path(entry["file"]).relative_to(ROOT))
    stamp = build / "tidy" / (name.replace("/", ".") + ".passed")
    now = fingerprint(entry, files)
    if stamp.exists() and stamp.read_text() == now:
        return ""
    run = subprocess.run(["clang-tidy", "--quiet", "-p", build, entry["file"]], capture_output=True, text=True)
    if run.returncode == 0:
        stamp.write_text(now)
        return ""
    return f"== {name}\n{run.stdout}{run.stderr if not run.stdout else ''}"


def main():
    build = Path(sys.argv[1]).resolve()
    (build / "tidy").mkdir(exist_ok=True)
    for rules in ROOT.glob("*/.clang-tidy"):  # the build tree mirrors ours, and unity files lie in it
        (build / rules.relative_to(ROOT)).write_bytes(rules.read_bytes())
    includes = includes_of(build)
    entries = [entry for entry in json.loads((build / "compile_commands.json").read_text())
               if all(path.is_relative_to(ROOT) and not path.is_relative_to(build) for path in sources_of(entry))]
    if not entries:
        sys.exit(f"{build}/compile_commands.json names no source of this project.")
    entries.sort(key=lambda entry: -len(sources_of(entry)))  # the longest first, so that all cores end together
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        findings = list(pool.map(lambda entry: tidy(build, entry, includes.get(object_of(entry), [])), entries))
    print("".join(findings), end="")
    count = sum(len(sources_of(entry)) for entry in entries)
    print(f"clang-tidy: {sum(map(bool, findings))} of {len(entries)} runs over {count} files have findings.")
    sys.exit(any(findings))


if __name__ == "__main__":
    main()
