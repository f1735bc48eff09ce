"""Scans as the wire API wants them. Units are "m" or "mm"; poses come back in the scan's."""

from pathlib import Path

import numpy as np

from binpose.v1 import types_pb2

UNITS = {"m": types_pb2.LENGTH_UNIT_METRE, "mm": types_pb2.LENGTH_UNIT_MILLIMETRE}


def unit_of(name):
    if name not in UNITS:
        raise ValueError(f'unit is {name!r}; it must be "m" or "mm"')
    return UNITS[name]


def points(xyz, *, unit, normals=None, sensor_position=None):
    """A cloud of points.

    xyz -- shape (n, 3), or (rows, columns, 3) for an organised one; NaN where nothing was measured.
    normals -- unit normals of the same shape; the server estimates them otherwise.
    sensor_position -- where the sensor stood, x y z in the scan's frame; the origin otherwise.
    """
    xyz = _packed(xyz, "xyz")
    rows, columns = (1, len(xyz)) if xyz.ndim == 2 else xyz.shape[:2]
    packed = types_pb2.PackedPoints(width=columns, height=rows, xyz=xyz.tobytes())
    if normals is not None:
        normals = _packed(normals, "normals")
        if normals.shape != xyz.shape:
            raise ValueError(f"normals has the shape {normals.shape}; it must have that of xyz, {xyz.shape}")
        packed.normals = normals.tobytes()
    return _cloud(unit, sensor_position, points=packed)


def depth_image(depth, *, fx, fy, cx, cy, unit, scale=1.0):
    """A depth image of a pinhole camera without distortion; the scan's frame is the camera's (x right, y down, z away).

    depth -- shape (rows, columns): uint16, 0 where nothing was measured; or a float type, 0 or NaN there.
    fx, fy, cx, cy -- pixels; cx = 0 is the centre of the first pixel.
    scale -- z in `unit` = value * scale.
    """
    depth = np.asarray(depth)
    if depth.ndim != 2:
        raise ValueError(f"depth has the shape {depth.shape}; it must be (rows, columns)")
    pixels = {"uint16": depth.astype("<u2").tobytes()} if depth.dtype == np.uint16 else {
        "float32": depth.astype("<f4").tobytes()}
    intrinsics = types_pb2.CameraIntrinsics(fx=fx, fy=fy, cx=cx, cy=cy)
    image = types_pb2.DepthImage(width=depth.shape[1], height=depth.shape[0], depth_scale=scale, intrinsics=intrinsics,
                                 **pixels)
    return _cloud(unit, None, depth=image)


def scan_file(path, *, unit, sensor_position=None):
    """A PLY or PCD file, sent as it is."""
    data = Path(path).read_bytes()
    return _cloud(unit, sensor_position, **{"ply" if data.startswith(b"ply") else "pcd": data})


def _packed(array, name):
    array = np.ascontiguousarray(array, dtype="<f4")
    if array.ndim not in (2, 3) or array.shape[-1] != 3:
        raise ValueError(f"{name} has the shape {array.shape}; it must be (n, 3) or (rows, columns, 3)")
    return array


def _cloud(unit, sensor_position, **data):
    cloud = types_pb2.PointCloud(unit=unit_of(unit), **data)
    if sensor_position is not None:
        cloud.sensor_position.x, cloud.sensor_position.y, cloud.sensor_position.z = map(float, sensor_position)
    return cloud
