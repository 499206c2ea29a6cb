"""Reads the data set's scans, PLY, by Open3D's tensor reader, and compares every field.

    python read_ply_open3d.py DATASET

Needs open3d, plyfile.
"""

import sys
from pathlib import Path

import open3d
from plyfile import PlyData

# What Open3D makes one tensor of; every other field keeps its name.
TOGETHER = {"positions": ["x", "y", "z"], "normals": ["nx", "ny", "nz"]}


def main(dataset):
    scans = points = 0
    fields = []
    for path in sorted(Path(dataset).glob("sequences/**/points/*.ply")):
        expected = PlyData.read(path)["vertex"].data
        cloud = open3d.t.io.read_point_cloud(str(path))
        fields = list(expected.dtype.names)
        found = {name: cloud.point[name].numpy() for name in cloud.point}
        for name, parts in TOGETHER.items():
            columns = found.pop(name)
            assert columns.shape == (len(expected), 3)
            found |= {part: columns[:, i] for i, part in enumerate(parts)}
        assert sorted(found) == sorted(fields), sorted(found)
        for name in fields:
            column = found[name].reshape(len(expected), -1)[:, 0]
            assert column.dtype == expected.dtype[name].newbyteorder("="), (name, column.dtype)
            assert (column == expected[name]).all(), name
        scans += 1
        points += len(expected)
    assert points > 0, "no points at all"
    print(f"ply, open3d: {scans} scans, {points} points, {len(fields)} fields equal")


main(*sys.argv[1:])
