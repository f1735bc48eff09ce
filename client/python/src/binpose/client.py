"""The calls, with errors as exceptions that say what to do."""

from pathlib import Path

import grpc

from binpose.result import Result
from binpose.scan import unit_of
from binpose.v1 import detection_service_pb2, detection_service_pb2_grpc, model_service_pb2, model_service_pb2_grpc, types_pb2

# The server states its own limits; gRPC's 4 MB would cut off answers and scans before it can.
OPTIONS = [("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1)]


class BinposeError(Exception):
    """A call or a scan that failed; `code` is a grpc.StatusCode."""

    def __init__(self, code, message):
        super().__init__(message)
        self.code = code


class Client:
    """A connection to a server, HOST:PORT; make one and keep it. Its methods may be called from several threads."""

    def __init__(self, server="localhost:50051", *, timeout=10, credentials=None):
        """timeout -- seconds that a short call may take; credentials -- from grpc.ssl_channel_credentials(), or none."""
        self._timeout = timeout
        self._channel = (grpc.secure_channel(server, credentials, OPTIONS) if credentials
                         else grpc.insecure_channel(server, OPTIONS))
        self._models = model_service_pb2_grpc.ModelServiceStub(self._channel)
        self._detection = detection_service_pb2_grpc.DetectionServiceStub(self._channel)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._channel.close()

    def train(self, model_id, mesh, *, unit, params=None, on_progress=None, timeout=600):
        """Makes a model of a mesh file (a path, or bytes), waits until it is served, and returns the binpose.v1.Model.

        params -- binpose.v1.TrainParams; on_progress -- called with (stage name, share done).
        """
        data = mesh if isinstance(mesh, bytes) else Path(mesh).read_bytes()
        request = model_service_pb2.TrainRequest(
            id=model_id, mesh=types_pb2.Mesh(data=data, unit=unit_of(unit)), params=params)
        model = None
        with _errors():
            for progress in self._models.Train(request, timeout=timeout):
                if on_progress:
                    on_progress(model_service_pb2.TrainStage.Name(progress.stage), progress.progress)
                if progress.HasField("model"):
                    model = progress.model
        if model is None:
            raise BinposeError(grpc.StatusCode.INTERNAL, "The training ended without a model.")
        return model

    def models(self):
        """All models, binpose.v1.Model each, by ID."""
        with _errors():
            request = model_service_pb2.ListModelsRequest()
            return list(self._models.ListModels(request, timeout=self._timeout).models)

    def model(self, model_id):
        with _errors():
            return self._models.GetModel(model_service_pb2.GetModelRequest(id=model_id), timeout=self._timeout)

    def delete(self, model_id):
        with _errors():
            self._models.DeleteModel(model_service_pb2.DeleteModelRequest(id=model_id), timeout=self._timeout)

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
            for answer in self._detection.Detect(requests, timeout=timeout):
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
