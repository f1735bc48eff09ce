"""A stream of scans that outlives the server at its other end."""

import random
import threading
import time
from collections import deque

import grpc

FIRST_PAUSE, LONGEST_PAUSE = 0.02, 2.0  # seconds; each is twice the one before, less a random part of up to a half


class Scans:
    """The scans of a stream, each kept until it is answered."""

    def __init__(self, source):
        self._source = iter(source)
        self._lock = threading.Lock()
        self._unanswered = deque()
        self._answered = 0

    def from_first_unanswered(self):
        """What one call sends: first what is not answered, then what was never sent."""
        number = self._answered
        while True:
            with self._lock:  # a call that has ended may still wait for a scan here: it leaves it to the next call
                if number < self._answered:
                    return
                if number == self._answered + len(self._unanswered):
                    try:
                        self._unanswered.append(next(self._source))
                    except StopIteration:
                        return
                scan = self._unanswered[number - self._answered]
            number += 1
            yield scan

    def note_answer(self):
        with self._lock:
            self._unanswered.popleft()
            self._answered += 1


def routing(model_id):
    """Headers that tell a balancer which model a call is about, so that all calls about it go to one server."""
    return [("x-model-id", model_id)] if model_id and model_id.isascii() and model_id.isprintable() else []


def is_lost(error):
    """Whether a call ended because its server did, or the way to it, rather than because of what was asked."""
    if error.code() == grpc.StatusCode.UNAVAILABLE:
        return True
    # What gRPC says of the ways in which a balancer passes on that a server went away. RST_STREAM 11 is the server's own
    # "too much".
    details = error.details() or ""
    signs = ("RST_STREAM", "Stream removed", "No status received")
    return "error code 11" not in details and any(sign in details for sign in signs)


def wait_for(channel, seconds):
    """Waits for a connection, at most so long; gRPC attends to one every five seconds only, unless somebody waits."""
    start = time.monotonic()
    ready = grpc.channel_ready_future(channel)
    try:
        ready.result(timeout=seconds)
        if time.monotonic() - start < FIRST_PAUSE / 2:  # it was connected: the server did not take the call
            time.sleep(seconds)
    except grpc.FutureTimeoutError:
        pass
    finally:
        ready.cancel()


def answers(servers, source, *, model_id, timeout, retries):
    """Yields the answer to each scan of `source`, in order. A stream that is lost is opened again, with the next server,
    and what was not answered is sent again, up to `retries` times in a row and not beyond `timeout` seconds in all."""
    end = None if timeout is None else time.monotonic() + timeout
    scans = Scans(source)
    failures = 0
    while True:
        server = servers.current()
        left = None if end is None else max(0, end - time.monotonic())
        call = server.detection.Detect(scans.from_first_unanswered(), timeout=left, metadata=routing(model_id))
        try:
            for answer in call:
                failures = 0
                scans.note_answer()
                yield answer
            return
        except grpc.RpcError as error:
            failures += 1
            pause = min(FIRST_PAUSE * 2 ** (failures - 1), LONGEST_PAUSE) * random.uniform(0.5, 1)
            if not is_lost(error) or failures > retries or (end is not None and time.monotonic() + pause > end):
                raise
            servers.leave(server)
            wait_for(servers.current().channel, pause)
        finally:
            call.cancel()  # where the caller takes no more answers
