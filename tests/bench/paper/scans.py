"""Fig. 3, 6 and 7 of the paper: a part's surface, and scans with what was recognised."""
import json

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  the backend comes first
import numpy as np  # noqa: E402

from plots import save  # noqa: E402
from tables import PARTS  # noqa: E402

SHOWN = "gear_housing"  # has indented areas, as the paper's part has
VIEWS = {"from above": (35, 40), "from below": (215, 40)}  # turns about x and z, degrees


def view(points, turn_x, turn_z):
    """Points as seen from one side: x right, y up, z towards the viewer."""
    a, b = np.radians([turn_x, turn_z])
    about_z = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    return np.asarray(points) @ (about_x @ about_z).T


def shown(log):
    return next((line for line in log if line["key"] == SHOWN), log[0])


def surface_of(entry):
    fields = [np.array([point[field] for point in entry["surface"]])
              for field in ("position", "normal", "observability")]
    return fields[0] * 1000, fields[1], fields[2]


def draw_surface(axis, points, normals, colours, turns, size):
    """The points of the side that is seen, the near ones over the far ones."""
    seen, facing = view(points, *turns), view(normals, *turns)[:, 2]
    order = [i for i in np.argsort(seen[:, 2]) if facing[i] > 0]
    axis.scatter(seen[order, 0], seen[order, 1], c=np.asarray(colours)[order], s=size, linewidths=0)
    axis.set_aspect("equal")
    axis.axis("off")


def observability(log, path):
    """Fig. 3: blue is seldom seen, red often."""
    entry = shown(log)
    points, normals, observed = surface_of(entry)
    scale = plt.cm.ScalarMappable(plt.Normalize(0, 0.5), "jet")
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for axis, (title, turns) in zip(axes, VIEWS.items()):
        draw_surface(axis, points, normals, scale.to_rgba(observed), turns, 60)
        axis.set_title(title, fontsize=10)
    figure.colorbar(scale, ax=axes, label="observability [Eq. 5]", shrink=0.8)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def selected_pairs(log, path):
    """Fig. 7: start points (circles) and end points (dots) of the pairs that each selection picks."""
    entry = shown(log)
    points, normals, _ = surface_of(entry)
    figure, axes = plt.subplots(2, 3, figsize=(10, 6.5))
    for column, (selection, pairs) in zip(axes.T, entry["pairs"].items()):
        for axis, (title, turns) in zip(column, VIEWS.items()):
            shades = 0.65 + 0.3 * np.clip(view(normals, *turns)[:, 2], 0, 1)
            draw_surface(axis, points, normals, np.repeat(shades[:, None], 3, axis=1), turns, 40)
            placed = view(np.array(pairs).reshape(-1, 3) * 1000, *turns).reshape(-1, 3, 3)
            axis.scatter(placed[:, 1:, 0], placed[:, 1:, 1], s=6, c="tab:blue", linewidths=0)
            axis.scatter(placed[:, 0, 0], placed[:, 0, 1], s=16, facecolors="none", edgecolors="tab:red", linewidths=0.8)
            axis.set_title(f"{selection}, {title}", fontsize=9)
    save(figure, path, dpi=70)


def read_scan(folder):
    """Depth in metres (0: none) and the camera."""
    camera = json.loads((folder / "camera.json").read_text())
    depth = plt.imread(folder / camera["depth_file"]) * 65535 * camera["depth_unit_mm"] / 1000
    return depth, camera


def shaded(depth):
    """The scan as if lit from the upper left."""
    slope = np.gradient(np.where(depth > 0, depth, np.nan))
    light = np.nan_to_num(0.62 - 180 * (slope[0] + slope[1]), nan=0.15)
    return np.repeat(np.clip(light, 0.15, 0.95)[..., None], 3, axis=2)


def paint(image, depth, camera, points, colour, tolerance=0.003):
    """Colours the pixels where the points lie on the measured surface."""
    u = np.rint(camera["fx"] * points[:, 0] / points[:, 2] + camera["cx"]).astype(int)
    v = np.rint(camera["fy"] * points[:, 1] / points[:, 2] + camera["cy"]).astype(int)
    for du in range(-2, 3):
        for dv in range(-2, 3):
            inside = (u + du >= 0) & (u + du < depth.shape[1]) & (v + dv >= 0) & (v + dv < depth.shape[0])
            rows, columns, z = (v + dv)[inside], (u + du)[inside], points[inside, 2]
            on = np.abs(depth[rows, columns] - z) < tolerance
            image[rows[on], columns[on]] = colour


def recognised(log, scenes, path):
    """Fig. 6: what the default finds, a colour for each part, over the scan; wrong poses in red."""
    palette = [colour for number, colour in enumerate(plt.get_cmap("tab20").colors) if number not in (6, 7)]  # no red
    figure, axes = plt.subplots(2, 2, figsize=(9, 7))
    for axis, entry in zip(axes.flat, log):
        depth, camera = read_scan(scenes / entry["scene"])
        plain = shaded(depth)
        image = plain.copy()
        points = np.array([point["position"] for point in entry["surface"]])
        for number, pose in enumerate(reversed(entry["recognised"])):
            T = np.array(pose["T_scene_model"])
            hue = (1, 0, 0) if pose["verdict"] < 0 else palette[number % len(palette)]
            paint(image, depth, camera, points @ T[:3, :3].T + T[:3, 3], hue)
        axis.imshow(np.clip(0.35 * plain + 0.65 * image, 0, 1))
        wrong = sum(pose["verdict"] < 0 for pose in entry["recognised"])
        axis.set_title(f"{PARTS[entry['key']]}: {len(entry['recognised'])} found, {wrong} wrong", fontsize=10)
        axis.axis("off")
    save(figure, path, dpi=70)
