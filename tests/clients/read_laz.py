"""Reads `nemoral convert --to laz` by laspy with lazrs, and compares it with the data set.

    python read_laz.py DATASET CONVERTED

Needs numpy, laspy, lazrs, plyfile, and pyproj for a site.
"""

import json
import sys
from pathlib import Path

import laspy
import numpy as np
from common import lidars, matrix, mount
from plyfile import PlyData


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    points = worst = 0
    for frame in manifest["frames"]:
        # The first LiDAR's folders are the sequence's own.
        folder = dataset / "sequences" / f"{frame['sequence']:02}"
        name = f"{frame['index']:06}"
        scan = PlyData.read(folder / "points" / f"{name}.ply")["vertex"].data
        lidar = lidars(manifest, frame["sequence"])[0]
        las = laspy.read(out / f"{frame['sequence']:02}" / lidar["name"] / f"{name}.laz")
        assert las.header.version == "1.4" and las.header.point_format.id == 6
        assert las.header.point_count == len(scan)
        here = np.stack([scan[a].astype(float) for a in "xyz"] + [np.ones(len(scan))], 1)
        pose = matrix(frame["world_from_body"]) @ mount(lidar["body_from_lidar"])
        # A site's are on the map.
        sequence = next(s for s in manifest["sequences"] if s["number"] == frame["sequence"])
        site = sequence.get("site", {"origin_m": [0, 0, 0]})
        if len(scan):
            off = (here @ pose.T)[:, :3] + site["origin_m"] - np.asarray(las.xyz)
            worst = max(worst, abs(off).max())
        if "epsg" in site:
            assert las.header.parse_crs().to_epsg() == site["epsg"]
        # What is fired together is a nanosecond apart.
        fired_s = frame["time_s"] + scan["t"] + 1e-9 * scan["ring"]
        assert abs(las.gps_time - fired_s).max() < 1e-9
        assert (las.return_number == scan["return_no"]).all()
        assert (las.number_of_returns == scan["n_returns"]).all()
        assert abs(np.asarray(las.intensity) / 65535 - scan["intensity"].clip(0, 1)).max() < 1e-5
        for name, field in [("ring", "ring"), ("class", "class"), ("semantic", "semantic"),
                            ("range", "range"), ("range_true", "range_true"), ("pulse", "pulse"),
                            ("incidence_cos", "incidence_cos"), ("flags", "flags")]:
            assert (las[name] == scan[field]).all(), name
        id_ = ((scan["chunk_x"] % 16) << 20) | ((scan["chunk_y"] % 16) << 16) | scan["item"]
        assert (las["instance"] == np.where(scan["item"] == 0, 0, id_)).all()
        if manifest["ontology"]["name"] == "paper":
            expected = np.array([7, 2, 2, 5, 5, 4, 3, 1])[scan["class"]]
            # Stump, log, fallen branch, root plate, ice and snow are unclassified; water is water.
            expected[np.isin(scan["semantic"], [12, 13, 29, 30, 34, 35])] = 1
            expected[scan["semantic"] == 33] = 9
            # What climbs trees is as high as they are.
            expected[scan["semantic"] == 20] = 5
            assert (las.classification == expected).all()
        points += len(scan)
    assert worst < 6e-5, worst
    print(f"laz: {len(manifest['frames'])} scans, {points} points to {worst:.1e} m")


main(*sys.argv[1:])
