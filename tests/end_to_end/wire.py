"""The API for scripts, through protobuf's own compiler: messages, stubs and a scan that is searched in a moment."""

import importlib
import subprocess
import sys
import tempfile
from pathlib import Path

import grpc

ROOT = Path(__file__).resolve().parents[2]
PART = ROOT / "tests/data/parts/bearing_support.stl"
SCENE = ROOT / "tests/data/scenes/bearing_support_01"

_generated = tempfile.TemporaryDirectory()
_protos = [path.relative_to(ROOT / "proto") for path in (ROOT / "proto/binpose").rglob("*.proto")]
subprocess.run(["protoc", f"--proto_path={ROOT / 'proto'}", f"--python_out={_generated.name}", *_protos], check=True)
sys.path.insert(0, _generated.name)
detection = importlib.import_module("binpose.v1.detection_service_pb2")
model = importlib.import_module("binpose.v1.model_service_pb2")
types = importlib.import_module("binpose.v1.types_pb2")

UNLIMITED = [("grpc.max_send_message_length", -1), ("grpc.max_receive_message_length", -1)]


class Api:
    """Stubs on a connection of their own; over TLS with the bytes of who vouches for the server."""

    def __init__(self, address, tls_ca=None):
        options = [*UNLIMITED, ("grpc.use_local_subchannel_pool", 1)]
        self.channel = (grpc.secure_channel(address, grpc.ssl_channel_credentials(tls_ca), options) if tls_ca else
                        grpc.insecure_channel(address, options))

    def _method(self, kind, name, request, response):
        return getattr(self.channel, kind)(f"/binpose.v1.{name}", request_serializer=request.SerializeToString,
                                           response_deserializer=response.FromString)

    def detect_bytes(self, requests, **options):
        """The same with requests that are encoded already."""
        return self.channel.stream_stream("/binpose.v1.DetectionService/Detect", request_serializer=None,
                                          response_deserializer=detection.DetectResponse.FromString)(
            iter(requests), **options)

    def detect(self, requests, **options):
        return self._method("stream_stream", "DetectionService/Detect", detection.DetectRequest,
                            detection.DetectResponse)(iter(requests), **options)

    def train(self, model_id, **options):
        request = model.TrainRequest(id=model_id, mesh=types.Mesh(data=PART.read_bytes(),
                                                                  unit=types.LENGTH_UNIT_MILLIMETRE))
        return self._method("unary_stream", "ModelService/Train", model.TrainRequest, model.TrainResponse)(
            request, **options)

    def models(self):
        return self._method("unary_unary", "ModelService/ListModels", model.ListModelsRequest,
                            model.ListModelsResponse)(model.ListModelsRequest(), timeout=120).models

    def delete(self, model_id):
        return self._method("unary_unary", "ModelService/DeleteModel", model.DeleteModelRequest,
                            model.DeleteModelResponse)(model.DeleteModelRequest(id=model_id), timeout=120)

    def export_model(self, model_id):
        parts = self._method("unary_stream", "ModelService/ExportModel", model.ExportModelRequest,
                             model.ExportModelResponse)(model.ExportModelRequest(id=model_id), timeout=120)
        return b"".join(part.data for part in parts)

    def import_model(self, model_id, data):
        return self._method("stream_unary", "ModelService/ImportModel", model.ImportModelRequest,
                            model.ImportModelResponse)(
            iter([model.ImportModelRequest(id=model_id, data=data)]), timeout=120).model


def scan_request(binpose, request_id="", model_id="part"):
    """The bin of SCENE as a request; `binpose` runs the command-line client."""
    from google.protobuf import json_format
    run = binpose("request", "--model", model_id, "--scene", SCENE, "--unit", "mm")
    request = json_format.Parse(run.stdout, detection.DetectRequest())
    request.request_id = request_id
    return request
