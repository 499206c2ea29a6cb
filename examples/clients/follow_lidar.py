"""Follows the scans of a data set's first LiDAR with KISS-ICP, and compares the path with the truth.

    python follow_lidar.py DATASET [SEQUENCE]
"""

import sys
from pathlib import Path

import numpy as np
from kiss_icp.config import load_config
from kiss_icp.kiss_icp import KissICP


def matrices(path):
    """KITTI's poses: twelve numbers a line."""
    rows = np.loadtxt(path, ndmin=2)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, :] = rows.reshape(-1, 3, 4)
    return poses


def calibration(path, name):
    for line in path.read_text().splitlines():
        key, _, numbers = line.partition(":")
        if key == name:
            pose = np.eye(4)
            pose[:3, :] = np.array(numbers.split(), dtype=float).reshape(3, 4)
            return pose
    return np.eye(4)


def main(dataset, sequence="00"):
    folder = Path(dataset) / "sequences" / sequence
    scans = sorted((folder / "velodyne").glob("*.bin"))
    # poses.txt is of the first camera; Tr takes points of the LiDAR to it.
    camera_from_lidar = calibration(folder / "calib.txt", "Tr")
    truth = matrices(folder / "poses.txt") @ camera_from_lidar
    truth = truth[[int(scan.stem) for scan in scans]]
    truth = np.linalg.inv(truth[0]) @ truth

    config = load_config(None)
    # Scans are deskewed already.
    config.data.deskew = False
    odometry = KissICP(config)
    found = []
    for scan in scans:
        points = np.fromfile(scan, dtype=np.float32).reshape(-1, 4)[:, :3].astype(np.float64)
        odometry.register_frame(points, np.zeros(len(points)))
        found.append(odometry.last_pose.copy())
    found = np.linalg.inv(found[0]) @ np.array(found)

    off_m = np.linalg.norm(found[:, :3, 3] - truth[:, :3, 3], axis=1)
    turns = np.linalg.inv(truth[:, :3, :3]) @ found[:, :3, :3]
    cosines = np.clip((np.trace(turns, axis1=1, axis2=2) - 1.0) / 2.0, -1.0, 1.0)
    length_m = np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1).sum()
    print(
        f"{len(scans)} scans over {length_m:.1f} m: off by {off_m.mean() * 100:.1f} cm in the mean, "
        f"{off_m[-1] * 100:.1f} cm at the end ({off_m[-1] / length_m:.2%}), "
        f"{np.degrees(np.arccos(cosines)).max():.2f} degrees at most"
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
