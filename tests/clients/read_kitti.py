"""Reads `nemoral convert --to kitti` by pykitti, and compares it with the data set.

    python read_kitti.py DATASET CONVERTED

Needs numpy, pykitti.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pykitti
from common import cameras


def matrix(rows):
    return np.vstack([np.array(rows).reshape(3, 4), [0, 0, 0, 1]])


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    frames = manifest["frames"]
    worst = pictures = points = 0
    for sequence in sorted({f["sequence"] for f in frames}):
        mine = [f for f in frames if f["sequence"] == sequence]
        source = dataset / "sequences" / f"{sequence:02}"
        drive = pykitti.odometry(str(out), f"{sequence:02}")
        assert len(drive) == len(mine)
        native = np.loadtxt(source / "poses.txt").reshape(-1, 3, 4)
        first = matrix(native[mine[0]["index"]])
        for k, frame in enumerate(mine):
            pose = np.linalg.inv(first) @ matrix(native[frame["index"]])
            worst = max(worst, abs(drive.poses[k] - pose).max())
            name = f"{frame['index']:06}"
            scan = np.fromfile(source / "velodyne" / f"{name}.bin", np.float32).reshape(-1, 4)
            assert (drive.get_velo(k) == scan).all()
            labels = (source / "labels" / f"{name}.label").read_bytes()
            copied = out / "sequences" / f"{sequence:02}" / "labels" / f"{k:06}.label"
            assert copied.read_bytes() == labels
            points += len(scan)
            picture = source / "image_2" / f"{name}.png"
            if picture.exists():
                grey, colour = drive.get_cam0(k), drive.get_cam2(k)
                difference = np.asarray(grey).astype(int) - np.asarray(colour.convert("L"))
                assert abs(difference).max() <= 1 and grey.mode == "L"
                pictures += 1
        tr = drive.calib.T_cam0_velo
        calib = dict(l.split(": ") for l in (source / "calib.txt").read_text().splitlines())
        assert abs(tr - matrix([float(v) for v in calib["Tr"].split()])).max() < 1e-12
        # The first pixel's centre is at (0, 0).
        for camera in cameras(manifest, sequence)[:1]:
            k = camera["intrinsics"]
            intrinsics = [[k["fx"], 0, k["cx"] - 0.5], [0, k["fy"], k["cy"] - 0.5], [0, 0, 1]]
            assert abs(drive.calib.K_cam2 - intrinsics).max() < 1e-9
    assert worst < 1e-9, worst
    print(f"kitti: {len(frames)} frames, {pictures} pictures, {points} points; poses to {worst:.1e}")


main(*sys.argv[1:])
