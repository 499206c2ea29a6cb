"""Reads `nemoral convert --to colmap` by pycolmap, and compares it with the data set.

    python read_colmap.py DATASET CONVERTED

Needs numpy, pillow, pycolmap. The points of scans are projected by pycolmap's own camera models and
poses, and by the data set's mounts and lenses.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pycolmap
from common import cameras, frames, mount, project, scan


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    images = points = 0
    worst = 0.0
    for folder in sorted(p for p in out.iterdir() if (p / "sparse").exists()):
        model = pycolmap.Reconstruction(str(folder / "sparse" / "0"))
        frame0 = np.vstack([np.loadtxt(folder / "frame0.txt").reshape(3, 4), [0, 0, 0, 1]])
        by_name = {i.name: i for i in model.images.values()}
        for frame in frames(manifest, int(folder.name)):
            world = scan(dataset, manifest, frame)
            for camera in cameras(manifest, frame["sequence"]):
                image = by_name[f"{camera['name']}/{frame['index']:06}.png"]
                assert (folder / "images" / image.name).exists()
                world_from_camera = frame["pose"] @ mount(camera["body_from_camera"])
                here = (np.linalg.inv(world_from_camera) @ world.T).T[:, :3]
                first = (np.linalg.inv(frame0) @ world.T).T[:, :3]
                pose = image.cam_from_world
                pose = pose() if callable(pose) else pose
                there = first @ pose.rotation.matrix().T + pose.translation
                assert abs(here - there).max() < 1e-6
                # What is in the picture, and well in front.
                pixels = project(camera["intrinsics"], here)
                k = camera["intrinsics"]
                inside = (here[:, 2] > 0.5) & (pixels > 0).all(1)
                inside &= (pixels < [k["width"], k["height"]]).all(1)
                found = model.cameras[image.camera_id].img_from_cam(there[inside])
                if inside.any():
                    worst = max(worst, abs(np.asarray(found) - pixels[inside]).max())
                images += 1
                points += int(inside.sum())
    assert images == sum(len(cameras(manifest, f["sequence"])) for f in manifest["frames"])
    assert worst < 1e-5, worst
    print(f"colmap: {images} pictures, {points} points on the same pixel to {worst:.1e}")


main(*sys.argv[1:])
