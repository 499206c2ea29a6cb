"""Reads `nemoral convert --to tum` by evo's trajectory reader, and compares it with the data set.

    python read_tum.py DATASET CONVERTED

Needs numpy, pillow, evo.
"""

import json
import sys
from pathlib import Path

import numpy as np
from evo.tools import file_interface
from PIL import Image


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    frames = json.loads((dataset / "dataset.json").read_text())["frames"]
    worst = depths = count = 0
    for folder in sorted(p for p in out.iterdir() if p.is_dir()):
        sequence, name = folder.name.split("-", 1)
        mine = [f for f in frames if f["sequence"] == int(sequence)]
        source = dataset / "sequences" / sequence
        trajectory = file_interface.read_tum_trajectory_file(str(folder / "groundtruth.txt"))
        trajectory.check()
        assert trajectory.num_poses == len(mine)
        poses = [np.vstack([np.array(f["world_from_body"]), [0, 0, 0, 1]]) for f in mine]
        # The mount is the same in all frames.
        mounts = [np.linalg.inv(p) @ t for p, t in zip(poses, trajectory.poses_se3)]
        for p, t in zip(poses, trajectory.poses_se3):
            worst = max(worst, abs(p @ mounts[0] - t).max())
        count += len(mine)
        if (folder / "accelerometer.txt").exists():
            table = np.loadtxt(folder / "accelerometer.txt")
            truth = np.loadtxt(source / "imu0" / "data.csv", delimiter=",")
            assert (np.rint(table[:, 0] * 1e9) == truth[:, 0]).all()
            assert (table[:, 1:] == truth[:, 4:]).all()
        if not (folder / "depth.txt").exists():
            continue
        if (source / name).exists():
            source = source / name
        rows = [l.split() for l in (folder / "depth.txt").read_text().splitlines() if l[0] != "#"]
        for (stamp, file), frame in zip(rows, mine, strict=True):
            assert abs(float(stamp) - frame["time_s"]) < 1e-6
            depth = np.asarray(Image.open(folder / file)).astype(float) / 5000
            native = source / "depth" / f"{frame['index']:06}"
            if native.with_suffix(".npy").exists():
                truth = np.load(native.with_suffix(".npy"))
            else:
                truth = np.asarray(Image.open(native.with_suffix(".png"))) / 256.0
            near = (truth > 0) & (truth < 13.1)
            assert abs(depth - truth)[near].max() < 1.1e-4
            assert (depth[truth > 13.2] == 0).all() and (depth[truth == 0] == 0).all()
            depths += near.sum()
    assert worst < 1e-6, worst
    print(f"tum: {count} poses to {worst:.1e}, {depths} depths")


main(*sys.argv[1:])
