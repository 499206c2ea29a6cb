"""Finds stems in a scanned plot with 3DFin, and compares them with the plot's inventory.

    python measure_stems.py PLOT.laz TREES.csv FOLDER [RADIUS]

PLOT.laz and TREES.csv are made by one `nemoral cloud PLOT --out PLOT.laz --trees TREES.csv`, so
that both are in the same coordinates, also on a site of one's own. Trees that stand in the plot,
within RADIUS (all, if it is not given) of the middle of the inventory, are compared.
"""

import csv
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import laspy
import numpy as np

# The thinnest stem that 3DFin fits circles to by default, and the farthest match.
THINNEST_M = 0.09
NEAR_M = 0.5


def main(plot, trees, folder, radius="inf"):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    defaults = Path(find_spec("three_d_fin").origin).parent / "3DFinconfig.ini"
    program = Path(sys.executable).parent / "3DFin"
    # Its window system is not needed.
    environment = os.environ | {"QT_QPA_PLATFORM": "offscreen"}
    command = [program, "cli", "--normalize", "--export_txt", plot, folder, defaults]
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
    table = folder / f"{Path(plot).stem}_dbh_and_heights.txt"
    found = np.loadtxt(table, ndmin=2)
    # Its coordinates are the file's.
    height, dbh, x, y = found.T
    fitted = dbh > 0.0

    # Trees outside may reach into the plot with a part of their crowns.
    with open(trees, newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["foot_inside"] == "true"]
    place = np.array([[float(row["x_m"]), float(row["y_m"])] for row in rows])
    true_dbh = np.array([float(row["dbh_m"]) for row in rows])
    true_height = np.array([float(row["height_m"]) for row in rows])
    inside = np.linalg.norm(place - place.mean(0), axis=1) <= float(radius)
    thick = (true_dbh >= THINNEST_M) & inside

    pairs, used = [], set()
    for i in np.flatnonzero(fitted):
        distance = np.linalg.norm(place - [x[i], y[i]], axis=1)
        nearest = int(np.argmin(distance))
        if distance[nearest] < NEAR_M and nearest not in used and thick[nearest]:
            used.add(nearest)
            pairs.append((i, nearest))
    if not pairs:
        sys.exit("no stem was found near a tree: are the cloud and the table of the same plot?")
    i, k = np.array(pairs).T
    off_mm = (dbh[i] - true_dbh[k]) * 1000
    near = np.abs(off_mm) < 50
    print(f"{len(laspy.read(plot).points):,} points, {thick.sum()} trees")
    print(
        f"{len(pairs)} stems found; diameters: median {np.median(off_mm):+.1f} mm, "
        f"{near.sum()} within 5 cm, of which bias {off_mm[near].mean():+.1f} mm, "
        f"RMSE {np.sqrt((off_mm[near] ** 2).mean()):.1f} mm"
    )
    off_m = height[i] - true_height[k]
    print(f"heights: median {np.median(off_m):+.2f} m, 90 % within {np.quantile(abs(off_m), 0.9):.2f} m")
    sectors = [row["stem_sectors_1_3m"] for row in rows]
    missed = [t for t in np.flatnonzero(thick) if t not in used]
    told = sorted(f"{true_dbh[t]:.2f} ({sectors[t]})" for t in missed)
    print(f"missed, by diameter (and sectors of 16 seen): {', '.join(told) or 'none'}")


if __name__ == "__main__":
    main(*sys.argv[1:])
