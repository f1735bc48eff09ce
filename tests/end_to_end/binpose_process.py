"""The two binaries as processes: a server of its own per test case, and the command-line client talking to it."""

import json
import os
import signal
import subprocess
from pathlib import Path

BIN = Path(os.environ["BINPOSE_BIN"])  # set by ctest: where the build put its binaries


class Server:
    """binpose-server on free ports; `address` and `metrics` are where it listens."""

    def __init__(self, model_dir, *arguments):
        self._process = subprocess.Popen(
            [BIN / "binpose-server", "--listen", "127.0.0.1:0", "--metrics", "127.0.0.1:0", "--model-dir", model_dir,
             "--threads", "1", "--log-level", "warning", *arguments],
            stdout=subprocess.PIPE, text=True)
        first_line = self._process.stdout.readline()  # "listening on HOST:PORT, metrics on HOST:PORT"
        self.address, self.metrics = (part.split(" on ")[1] for part in first_line.strip().split(", "))

    def stop(self):
        """Ends it as systemd or Docker would; returns the exit status."""
        self._process.send_signal(signal.SIGTERM)
        status = self._process.wait(timeout=300)
        self._process.stdout.close()
        return status

    def kill(self):
        """Ends it at once, as a power cut would."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def resident_bytes(self):
        return 4096 * int(Path(f"/proc/{self._process.pid}/statm").read_text().split()[1])

    def thread_count(self):
        return len(list(Path(f"/proc/{self._process.pid}/task").iterdir()))

    @staticmethod
    def help(command):
        """What the client says about a subcommand."""
        return subprocess.run([BIN / "binpose", command, "--help"], capture_output=True, text=True, check=True).stdout

    def binpose(self, *arguments):
        """Runs the client; returns the finished process with its output as text."""
        return subprocess.run([BIN / "binpose", *arguments, "--server", self.address], capture_output=True, text=True,
                              timeout=300)

    def binpose_json(self, *arguments):
        """The objects that `binpose ... --json` prints, one a line; the command must succeed."""
        run = self.binpose(*arguments, "--json")
        if run.returncode != 0:
            raise AssertionError(f"binpose {' '.join(map(str, arguments))} failed: {run.stderr}")
        return [json.loads(line) for line in run.stdout.splitlines()]
