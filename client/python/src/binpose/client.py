"""The calls, with errors as exceptions that say what to do."""

from pathlib import Path

import grpc

from binpose import stream
from binpose.result import Result
from binpose.scan import unit_of
from binpose.v1 import detection_service_pb2, detection_service_pb2_grpc, model_service_pb2, model_service_pb2_grpc, types_pb2

# The server states its own limits; gRPC's 4 MB would cut off answers and scans before it can.
OPTIONS = [("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1),
           # gRPC's own pauses, of up to two minutes, would outlast the restart of a server.
           ("grpc.initial_reconnect_backoff_ms", 50), ("grpc.min_reconnect_backoff_ms", 2000),
           ("grpc.max_reconnect_backoff_ms", 1000)]


class BinposeError(Exception):
    """A call or a scan that failed; `code` is a grpc.StatusCode."""

    def __init__(self, code, message):
        super().__init__(message)
        self.code = code


class _Stubs:
    """Of one server, or of the balancer before several."""

    def __init__(self, address, credentials):
        self.channel = (grpc.secure_channel(address, credentials, OPTIONS) if credentials
                        else grpc.insecure_channel(address, OPTIONS))
        self.models = model_service_pb2_grpc.ModelServiceStub(self.channel)
        self.detection = detection_service_pb2_grpc.DetectionServiceStub(self.channel)


class _Servers:
    """Those of a connection, of which one is called until it is lost."""

    def __init__(self, addresses, credentials):
        self.all = [_Stubs(address.strip(), credentials) for address in addresses.split(",")]
        self._current = self.all[0]

    def current(self):
        return self._current

    def leave(self, lost):
        """Goes on to the next, unless another caller has done so."""
        if self._current is lost:
            self._current = self.all[(self.all.index(lost) + 1) % len(self.all)]


class Client:
    """A connection to a server, HOST:PORT, or to several with commas between, of which the next is taken where one is
    lost. Make one and keep it. Its methods may be called from several threads."""

    def __init__(self, server="localhost:50051", *, timeout=10, credentials=None, retries=8):
        """timeout -- seconds that a short call may take; credentials -- from grpc.ssl_channel_credentials(), or none;
        retries -- how often in a row a lost stream of scans is opened again and what was not answered sent again; 0: an
        error at once."""
        self._timeout = timeout
        self._retries = retries
        self._servers = _Servers(server, credentials)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        for server in self._servers.all:
            server.channel.close()

    def _call(self, make):
        """Makes a call, on the next server where one cannot be reached."""
        with _errors():
            for tries_left in reversed(range(len(self._servers.all) if self._retries else 1)):
                server = self._servers.current()
                try:
                    return make(server)
                except grpc.RpcError as error:
                    if error.code() != grpc.StatusCode.UNAVAILABLE or tries_left == 0:
                        raise
                    self._servers.leave(server)

    def train(self, model_id, mesh, *, unit, params=None, on_progress=None, timeout=600):
        """Makes a model of a mesh file (a path, or bytes), waits until it is served, and returns the binpose.v1.Model.

        params -- binpose.v1.TrainParams; on_progress -- called with (stage name, share done).
        """
        data = mesh if isinstance(mesh, bytes) else Path(mesh).read_bytes()
        request = model_service_pb2.TrainRequest(
            id=model_id, mesh=types_pb2.Mesh(data=data, unit=unit_of(unit)), params=params)

        def train(server):
            model = None
            for progress in server.models.Train(request, timeout=timeout, metadata=stream.routing(model_id)):
                if on_progress:
                    on_progress(model_service_pb2.TrainStage.Name(progress.stage), progress.progress)
                if progress.HasField("model"):
                    model = progress.model
            return model

        model = self._call(train)
        if model is None:
            raise BinposeError(grpc.StatusCode.INTERNAL, "The training ended without a model.")
        return model

    def models(self):
        """All models, binpose.v1.Model each, by ID."""
        request = model_service_pb2.ListModelsRequest()
        return list(self._call(lambda server: server.models.ListModels(request, timeout=self._timeout)).models)

    def model(self, model_id):
        request = model_service_pb2.GetModelRequest(id=model_id)
        return self._call(lambda server: server.models.GetModel(request, timeout=self._timeout,
                                                                 metadata=stream.routing(model_id)))

    def delete(self, model_id):
        request = model_service_pb2.DeleteModelRequest(id=model_id)
        self._call(lambda server: server.models.DeleteModel(request, timeout=self._timeout, metadata=stream.routing(model_id)))

    def detect(self, models, scan, *, params=None, time_budget=None, timeout=60):
        """Finds parts in one scan. models -- an ID, or several; params -- binpose.v1.DetectParams; time_budget -- seconds
        after which the server answers the best that it has found so far."""
        [result] = self.detect_all(models, [scan], params=params, time_budget=time_budget, timeout=timeout)
        if isinstance(result, BinposeError):
            raise result
        return result

    def detect_all(self, models, scans, *, params=None, time_budget=None, timeout=None):
        """Yields the Result of each scan, in order, over one stream; a BinposeError in place of one that failed.

        scans -- from points(), depth_image() or scan_file(); any iterable, taken as the server gets on.
        """
        ids = [models] if isinstance(models, str) else list(models)
        requests = (detection_service_pb2.DetectRequest(model_ids=ids, cloud=scan, params=params,
                                                        time_budget_seconds=time_budget) for scan in scans)
        with _errors():
            for answer in stream.answers(self._servers, requests, model_id=ids[0] if ids else "", timeout=timeout,
                                         retries=self._retries):
                if answer.HasField("error"):
                    yield BinposeError(_code(answer.error.code), answer.error.message)
                else:
                    yield Result.of(answer)


def _code(number):
    return next((code for code in grpc.StatusCode if code.value[0] == number), grpc.StatusCode.UNKNOWN)


class _errors:
    """Turns gRPC's exceptions into ours."""

    def __enter__(self):
        return self

    def __exit__(self, _, error, __):
        if isinstance(error, grpc.RpcError):
            raise BinposeError(error.code(), error.details()) from error
