"""Reads `nemoral convert --to colmap` by pycolmap, and compares it with the data set.

    python read_colmap.py DATASET CONVERTED

Needs numpy, pillow, pycolmap. The points of scans are projected by pycolmap's own camera models and
poses, and by the data set's mounts and lenses. A picture shows each of the model's own points, as
far away as its depth says.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pycolmap
from common import cameras, frames, mount, project, scan, shows
from PIL import Image


def depth_of(dataset, sequence, camera, name):
    folder = dataset / "sequences" / f"{sequence:02}"
    folder = folder / camera if (folder / camera).exists() else folder
    npy = folder / "depth" / f"{name}.npy"
    return np.load(npy) if npy.exists() else np.asarray(Image.open(npy.with_suffix(".png"))) / 256


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    images = points = own = 0
    worst = 0.0
    for folder in sorted(p for p in out.iterdir() if (p / "sparse").exists()):
        model = pycolmap.Reconstruction(str(folder / "sparse" / "0"))
        frame0 = np.vstack([np.loadtxt(folder / "frame0.txt").reshape(3, 4), [0, 0, 0, 1]])
        by_name = {i.name: i for i in model.images.values()}
        own_points = np.array([p.xyz for p in model.points3D.values()])
        colours = np.array([p.color for p in model.points3D.values()])
        assert all(p.track.length() == 0 for p in model.points3D.values())
        shown = np.zeros(len(own_points), bool)
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
                depth = depth_of(dataset, frame["sequence"], camera["name"], f"{frame['index']:06}")
                picture = np.asarray(Image.open(folder / "images" / image.name))
                there = own_points @ pose.rotation.matrix().T + pose.translation
                shown |= shows(k, there, colours, picture, depth)
        assert len(shown) > 0 and shown.all(), (len(shown), shown.sum())
        own += len(shown)
    assert images == sum(len(cameras(manifest, f["sequence"])) for f in manifest["frames"])
    assert worst < 1e-5, worst
    print(f"colmap: {images} pictures, {points} points on the same pixel to {worst:.1e}; {own} own "
          "points")


main(*sys.argv[1:])
