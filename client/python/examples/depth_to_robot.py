"""From a depth image to a robot target: finds the best part that nothing lies on, and says where the gripper goes.

    depth_to_robot.py --model ID --scene FOLDER --cell cell.json [--server HOST:PORT]

FOLDER holds camera.json (fx, fy, cx, cy in pixels; depth_file; depth_unit_mm) and the depth image that it names.
cell.json holds two 4 x 4 matrices in millimetres: T_base_camera, from your hand-eye calibration, and T_model_grasp,
where on the part the gripper takes hold, in the CAD file's frame. The target is printed as JSON, in the robot's base.
"""

import argparse
import json
import sys
from pathlib import Path

import binpose
import numpy as np
from PIL import Image


def read_depth(folder):
    camera = json.loads((folder / "camera.json").read_text())
    depth = np.asarray(Image.open(folder / camera["depth_file"])).astype(np.uint16)
    lens = {name: camera[name] for name in ("fx", "fy", "cx", "cy")}
    return binpose.depth_image(depth, **lens, scale=camera["depth_unit_mm"], unit="mm")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--server", default="localhost:50051")
    parser.add_argument("--model", required=True)
    parser.add_argument("--scene", type=Path, required=True)
    parser.add_argument("--cell", type=Path, required=True)
    options = parser.parse_args()

    cell = {name: np.array(matrix, dtype=float) for name, matrix in json.loads(options.cell.read_text()).items()}
    with binpose.Client(options.server) as client:
        result = client.detect(options.model, read_depth(options.scene))
    free = [part for part in result.parts if not part.occluded_by]
    if not free:
        sys.exit("Nothing to take: " + " ".join(result.warnings or ["every part lies under another."]))
    best = free[0]
    T_base_grasp = cell["T_base_camera"] @ best.T_scene_model @ cell["T_model_grasp"]
    print(json.dumps({"score": round(best.score, 3), "T_base_grasp": T_base_grasp.round(4).tolist()}))


if __name__ == "__main__":
    main()
