"""Reads `nemoral convert --to nerfstudio` by numpy and plyfile, and compares it with the data set.

    python read_nerfstudio.py DATASET CONVERTED

Needs numpy, pillow, plyfile.
"""

import json
import sys
from pathlib import Path

import numpy as np
from common import cameras, frames, mount, project, scan, shows
from PIL import Image
from plyfile import PlyData


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    images = points = own = 0
    worst = 0.0
    for file in sorted(out.glob("*/transforms.json")):
        metas = [json.loads(path.read_text()) for path in file.parent.glob("transforms*.json")]
        # nerfstudio takes the file's model for all of its frames.
        assert all(f["camera_model"] == m["camera_model"] for m in metas for f in m["frames"])
        meta = metas[0]
        by_name = {f["file_path"]: f for m in metas for f in m["frames"]}
        assert all(m["ply_file_path"] == "points.ply" for m in metas)
        cloud = PlyData.read(file.parent / "points.ply")["vertex"]
        own_points = np.column_stack([cloud[axis] for axis in "xyz"]).astype(float)
        colours = np.column_stack([cloud[c] for c in ("red", "green", "blue")])
        shown = np.zeros(len(own_points), bool)
        for frame in frames(manifest, int(file.parent.name)):
            world = scan(dataset, manifest, frame)
            for camera in cameras(manifest, frame["sequence"]):
                one = by_name[f"images/{camera['name']}/{frame['index']:06}.png"]
                assert (file.parent / one["file_path"]).exists()
                assert one["time"] == frame["time_s"]
                pose = frame["pose"] @ mount(camera["body_from_camera"])
                truth = project(camera["intrinsics"], (np.linalg.inv(pose) @ world.T).T)
                # OpenGL's camera looks along -z, with y up.
                moved = world[:, :3] - meta["origin_m"]
                c2w = np.array(one["transform_matrix"])
                here = (moved - c2w[:3, 3]) @ c2w[:3, :3] * [1, -1, -1]
                fish = one["camera_model"] == "OPENCV_FISHEYE"
                lens = {k: one.get(k, 0.0) for k in ("k1", "k2", "k3", "k4", "p1", "p2")}
                lens["model"] = "fisheye" if fish else "brown_conrady"
                k = dict(fx=one["fl_x"], fy=one["fl_y"], cx=one["cx"], cy=one["cy"])
                found = project(k | {"distortion": lens}, here)
                inside = (here[:, 2] > 0.5) & (truth > 0).all(1)
                inside &= (truth < [one["w"], one["h"]]).all(1)
                if inside.any():
                    worst = max(worst, abs(found - truth)[inside].max())
                images += 1
                points += int(inside.sum())
                folder = dataset / "sequences" / f"{frame['sequence']:02}"
                if (folder / camera["name"]).exists():
                    folder = folder / camera["name"]
                depth = folder / "depth" / f"{frame['index']:06}.npy"
                depth = (np.load(depth) if depth.exists()
                         else np.asarray(Image.open(depth.with_suffix(".png"))) / 256)
                picture = np.asarray(Image.open(file.parent / one["file_path"]))
                there = (own_points - c2w[:3, 3]) @ c2w[:3, :3] * [1, -1, -1]
                shown |= shows(camera["intrinsics"], there, colours, picture, depth)
        assert len(shown) > 0 and shown.all(), (len(shown), shown.sum())
        own += len(shown)
    assert images == sum(len(cameras(manifest, f["sequence"])) for f in manifest["frames"])
    assert worst < 1e-6, worst
    print(f"nerfstudio: {images} pictures, {points} points on the same pixel to {worst:.1e}; {own} "
          "own points")


main(*sys.argv[1:])
