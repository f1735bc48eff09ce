"""Client of binpose-server: trains parts and finds them in scans, with numpy arrays on both sides.

    with binpose.Client("localhost:50051") as client:
        client.train("gear", "gear.stl", unit="mm")
        result = client.detect("gear", binpose.scan_file("bin.ply", unit="mm"))
        print(result.parts[0].T_scene_model)
"""

from binpose.client import BinposeError, Client
from binpose.result import Part, Result
from binpose.scan import depth_image, points, scan_file

__all__ = ["BinposeError", "Client", "Part", "Result", "depth_image", "points", "scan_file"]
