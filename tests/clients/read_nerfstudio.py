"""Reads `nemoral convert --to nerfstudio` by numpy, and compares it with the data set.

    python read_nerfstudio.py DATASET CONVERTED

Needs numpy.
"""

import json
import sys
from pathlib import Path

import numpy as np
from common import cameras, frames, mount, project, scan


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    images = points = 0
    worst = 0.0
    for file in sorted(out.glob("*/transforms.json")):
        metas = [json.loads(path.read_text()) for path in file.parent.glob("transforms*.json")]
        # nerfstudio takes the file's model for all of its frames.
        assert all(f["camera_model"] == m["camera_model"] for m in metas for f in m["frames"])
        meta = metas[0]
        by_name = {f["file_path"]: f for m in metas for f in m["frames"]}
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
    assert images == sum(len(cameras(manifest, f["sequence"])) for f in manifest["frames"])
    assert worst < 1e-6, worst
    print(f"nerfstudio: {images} pictures, {points} points on the same pixel to {worst:.1e}")


main(*sys.argv[1:])
