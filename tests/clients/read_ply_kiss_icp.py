"""Reads the data set's scans, PLY, as KISS-ICP does: points, and `t` as the time of each.

    python read_ply_kiss_icp.py DATASET

Needs kiss-icp, open3d, plyfile.
"""

import sys
from pathlib import Path

from kiss_icp.datasets.generic import GenericDataset
from plyfile import PlyData


def main(dataset):
    scans = points = 0
    for folder in sorted(Path(dataset).glob("sequences/**/points")):
        paths = sorted(folder.glob("*.ply"))
        loader = GenericDataset(folder)
        assert len(loader) == len(paths) > 0, folder
        for path, (xyz, times) in zip(paths, loader, strict=True):
            scan = PlyData.read(path)["vertex"].data
            assert xyz.shape == (len(scan), 3) and times.shape == (len(scan),)
            for axis, name in enumerate("xyz"):
                assert (xyz[:, axis] == scan[name]).all(), name
            assert (times == scan["t"]).all()
            # The scan's middle is the frame's time.
            assert times.min() < 0 < times.max()
            scans += 1
            points += len(scan)
    print(f"ply, kiss-icp: {scans} scans, {points} points with their times equal")


main(*sys.argv[1:])
