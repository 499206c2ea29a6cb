"""Reads `nemoral convert --to laz` by laspy with lazrs, and compares it with the data set.

    python read_laz.py DATASET CONVERTED

Needs numpy, laspy, lazrs, plyfile, and pyproj for a site.
"""

import csv
import json
import sys
from pathlib import Path

import laspy
import numpy as np
from common import lidars, matrix, mount, spec
from plyfile import PlyData

# Classes of the paper's that a tree's points may have: Trunks and Canopy.
TREE_CLASSES = [3, 4]


def tree_rows(folder):
    """The row in trees.csv of each tree, from 1, by its true id."""
    with open(folder / "trees.csv", newline="") as file:
        ids = [tuple(int(row[k]) for k in ("chunk_x", "chunk_y", "item"))
               for row in csv.DictReader(file)]
    return {id_: row for row, id_ in enumerate(ids, 1)}


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    is_paper = manifest["ontology"]["name"] == "paper"
    points = scans = 0
    worst = 0.0
    for frame in manifest["frames"]:
        sequence = spec(manifest, frame["sequence"])
        folder = dataset / "sequences" / f"{frame['sequence']:02}"
        rows = tree_rows(folder)
        body = matrix(frame["world_from_body"])
        # Readers know a return by the time of its pulse, its number, and the scanner's channel.
        returns = []
        for i, lidar in enumerate(lidars(manifest, frame["sequence"])):
            # The first LiDAR's folders are the sequence's own.
            own = folder if i == 0 else folder / lidar["name"]
            name = f"{frame['index']:06}"
            scan = PlyData.read(own / "points" / f"{name}.ply")["vertex"].data
            las = laspy.read(out / f"{frame['sequence']:02}" / lidar["name"] / f"{name}.laz")
            body_from_lidar = mount(lidar["body_from_lidar"])
            off = compare(las, scan, sequence, frame["time_s"], i, body @ body_from_lidar)
            worst = max(worst, off)
            # The level direction to the left of where the body heads, in the LiDAR's axes.
            ahead = body[:2, 0] / np.hypot(*body[:2, 0])
            level_left = np.array([-ahead[1], ahead[0], 0.0])
            to_left = level_left @ (body @ body_from_lidar)[:3, :3]
            left = np.stack([scan[a].astype(float) for a in "xyz"], 1) @ to_left
            angle = np.asarray(las.scan_angle)
            clear = (abs(left) > 1e-3) & (angle != 0)
            assert ((angle < 0) == (left > 0))[clear].all()
            ids = zip(scan["chunk_x"].tolist(), scan["chunk_y"].tolist(), scan["item"].tolist())
            trees = np.array([rows.get(id_, 0) for id_ in ids], int)
            assert (las["treeID"] == trees).all()
            if is_paper:
                assert not trees[~np.isin(scan["class"], TREE_CLASSES)].any()
                compare_classes(las, scan)
            returns.append(np.stack([las.gps_time, las.return_number, las.scanner_channel], 1))
            points += len(scan)
            scans += 1
        returns = np.concatenate(returns)
        assert len(np.unique(returns, axis=0)) == len(returns)
    assert worst < 6e-5, worst
    print(f"laz: {scans} scans, {points} points to {worst:.1e} m")


def compare(las, scan, sequence, time_s, lidar, world_from_lidar):
    """Compares a file with a scan. Returns how far points are off, metres."""
    assert las.header.version == "1.4" and las.header.point_format.id == 6
    assert las.header.point_count == len(scan)
    here = np.stack([scan[a].astype(float) for a in "xyz"] + [np.ones(len(scan))], 1)
    # A site's are on the map.
    site = sequence.get("site", {"origin_m": [0, 0, 0]})
    off = (here @ world_from_lidar.T)[:, :3] + site["origin_m"] - np.asarray(las.xyz)
    if "epsg" in site:
        assert las.header.parse_crs().to_epsg() == site["epsg"]
    # What is fired together is a nanosecond apart, and 256 nanoseconds from LiDAR to LiDAR.
    start_s = np.floor(sequence.get("half_scan_s", 0.0)) + 1.0
    fired_s = start_s + time_s + scan["t"] + 1e-9 * (scan["ring"].astype(float) + 256 * lidar)
    gps_time = np.asarray(las.gps_time)
    assert (abs(gps_time - fired_s) < 1e-9).all() and (gps_time >= 0.0).all()
    assert (las.scanner_channel == lidar % 4).all() and (las.user_data == lidar + 1).all()
    assert (las.return_number == scan["return_no"]).all()
    assert (las.number_of_returns == scan["n_returns"]).all()
    intensity = np.asarray(las.intensity) / 65535
    assert (abs(intensity - scan["intensity"].clip(0, 1)) < 1e-5).all()
    for field in ["ring", "class", "semantic", "chunk_x", "chunk_y", "range", "range_true",
                  "pulse", "incidence_cos", "flags"]:
        assert (las[field] == scan[field]).all(), field
    id_ = ((scan["chunk_x"] % 16) << 20) | ((scan["chunk_y"] % 16) << 16) | scan["item"]
    assert (las["instance"] == np.where(scan["item"] == 0, 0, id_)).all()
    extra = list(las.point_format.extra_dimensions)
    assert len(extra) == 12 and all(dimension.description for dimension in extra)
    return abs(off).max(initial=0.0)


def compare_classes(las, scan):
    """Compares ASPRS' classes with the paper's."""
    expected = np.array([7, 2, 2, 5, 5, 4, 3, 1])[scan["class"]]
    # Stump, log, fallen branch, root plate, ice and snow are unclassified; water is water.
    expected[np.isin(scan["semantic"], [12, 13, 29, 30, 34, 35])] = 1
    expected[scan["semantic"] == 33] = 9
    # What climbs trees is as high as they are.
    expected[scan["semantic"] == 20] = 5
    # An echo in the air is high noise.
    expected[scan["semantic"] == 36] = 18
    assert (las.classification == expected).all()


main(*sys.argv[1:])
