"""Reads `nemoral convert --to laz` by laspy with lazrs, and compares it with the data set.

    python laz.py DATASET CONVERTED

Needs numpy, laspy, lazrs, plyfile.
"""

import json
import sys
from pathlib import Path

import laspy
import numpy as np
from plyfile import PlyData


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    points = worst = 0
    for frame in manifest["frames"]:
        folder = dataset / "sequences" / f"{frame['sequence']:02}"
        # The first LiDAR's folders are the sequence's own.
        name = f"{frame['index']:06}"
        scan = PlyData.read(folder / "points" / f"{name}.ply")["vertex"].data
        laz = sorted((out / f"{frame['sequence']:02}").glob(f"*/{name}.laz"))
        lidar = [l["name"] for l in manifest["lidars"]][0]
        las = laspy.read(next(p for p in laz if p.parent.name == lidar))
        assert las.header.version == "1.4" and las.header.point_format.id == 6
        assert las.header.point_count == len(scan)
        # The mount follows from the first points; then all others must agree.
        here = np.stack([scan[a].astype(float) for a in "xyz"], 1)
        there = np.asarray(las.xyz)
        if len(scan):
            a, b = here - here.mean(0), there - there.mean(0)
            u, _, v = np.linalg.svd(a.T @ b)
            turn = v.T @ np.diag([1, 1, np.linalg.det(v.T @ u.T)]) @ u.T
            worst = max(worst, abs(a @ turn.T - b).max())
            sensor = there.mean(0) - turn @ here.mean(0)
            body = np.array(frame["world_from_body"])[:, 3]
            assert np.linalg.norm(sensor - body) < 5, "in world coordinates"
        assert abs(las.gps_time - (frame["time_s"] + scan["t"])).max() < 1e-9
        assert (las.return_number == scan["return_no"]).all()
        assert (las.number_of_returns == scan["n_returns"]).all()
        assert abs(np.asarray(las.intensity) / 65535 - scan["intensity"].clip(0, 1)).max() < 1e-5
        for name, field in [("ring", "ring"), ("class", "class"), ("semantic", "semantic"),
                            ("range", "range"), ("range_true", "range_true"), ("pulse", "pulse"),
                            ("incidence_cos", "incidence_cos"), ("flags", "flags")]:
            assert (las[name] == scan[field]).all(), name
        id_ = ((scan["chunk_x"] % 16) << 20) | ((scan["chunk_y"] % 16) << 16) | scan["item"]
        assert (las["instance"] == np.where(scan["item"] == 0, 0, id_)).all()
        if [c["name"] for c in manifest["ontology"]["classes"]][:3] == [
            "Background", "Terrain", "Traversable"
        ] and manifest["ontology"]["name"] == "paper":
            asprs = np.array([7, 2, 2, 5, 5, 4, 3, 1])
            assert (las.classification == asprs[scan["class"]]).all()
        points += len(scan)
    assert worst < 2e-4, worst
    print(f"laz: {len(manifest['frames'])} scans, {points} points to {worst:.1e} m")


main(*sys.argv[1:])
