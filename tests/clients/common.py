"""What several clients need of a data set: mounts, lenses, scans and objects, by numpy alone."""

import csv

import numpy as np


def matrix(rows):
    return np.vstack([np.array(rows, float).reshape(3, 4), [0, 0, 0, 1]])


def mount(value):
    """A rigid transform of dataset.json."""
    if isinstance(value, dict):
        x, y, z, w = value.get("rotation_xyzw", value.get("rotation"))
        turn = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ])
        return matrix(np.column_stack([turn, value["translation_m"]]))
    return matrix(value)


def spec(manifest, sequence):
    """What dataset.json says of a sequence."""
    return next(s for s in manifest["sequences"] if s["number"] == sequence)


def cameras(manifest, sequence):
    """The cameras of a sequence."""
    return spec(manifest, sequence)["cameras"]


def lidars(manifest, sequence):
    """The LiDARs of a sequence."""
    return spec(manifest, sequence)["lidars"]


def frames(manifest, sequence):
    """The frames of a sequence, with their body's pose as a matrix."""
    mine = [f for f in manifest["frames"] if f["sequence"] == sequence]
    return [f | {"pose": matrix(f["world_from_body"])} for f in mine]


def metres(codes):
    """Depth by the codes of a 16-bit PNG, of which the greatest stands for all that is farther."""
    codes = np.asarray(codes)
    return np.where(codes == 65535, np.inf, codes / 256).astype(np.float32)


def kinds(dataset, frame):
    """The kinds of objects by their ids in a frame's instance maps: of several with the same id,
    which are 16 chunks apart, that of the nearest one.
    """
    body = np.array(frame["world_from_body"])[:2, 3]
    table = dataset / "sequences" / f"{frame['sequence']:02}" / "instances.csv"
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    rows.sort(key=lambda row: -np.hypot(*(body - [float(row["x_m"]), float(row["y_m"])])))
    return {int(row["image_id"]): row["kind"] for row in rows}


def scan(dataset, manifest, frame):
    """The first LiDAR's points in the world, homogeneous."""
    folder = dataset / "sequences" / f"{frame['sequence']:02}" / "velodyne"
    points = np.fromfile(folder / f"{frame['index']:06}.bin", "<f4").reshape(-1, 4).astype(float)
    points[:, 3] = 1
    lidar = lidars(manifest, frame["sequence"])[0]
    return points @ (frame["pose"] @ mount(lidar["body_from_lidar"])).T


def project(k, points):
    """Pixels of points in a camera's frame, by OpenCV's formulas."""
    with np.errstate(all="ignore"):
        x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
        lens = k.get("distortion", {"model": "none"})
        r2 = x * x + y * y
        if lens["model"] == "brown_conrady":
            radial = 1 + r2 * (lens["k1"] + r2 * (lens["k2"] + r2 * lens["k3"]))
            p1, p2 = lens["p1"], lens["p2"]
            x, y = (
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            )
        elif lens["model"] == "fisheye":
            r = np.sqrt(r2)
            t = np.arctan(r)
            t2 = t * t
            c = [lens[f"k{i}"] for i in range(1, 5)]
            bent = t * (1 + t2 * (c[0] + t2 * (c[1] + t2 * (c[2] + t2 * c[3]))))
            x, y = x * bent / r, y * bent / r
        else:
            assert lens["model"] == "none", lens
        return np.column_stack([k["fx"] * x + k["cx"], k["fy"] * y + k["cy"]])


def shows(k, points, colours, picture, depth):
    """Which points in a camera's frame its picture shows: with their colours, as far away."""
    pixels = project(k, points)
    inside = (points[:, 2] > 0) & (pixels > 0).all(1) & (pixels < [k["width"], k["height"]]).all(1)
    column, row = np.floor(pixels[inside]).astype(int).T
    same = abs(depth[row, column] - points[inside, 2]) < 1e-3
    inside[inside] = same & (picture[row, column] == colours[inside]).all(1)
    return inside
