"""Reads `nemoral convert --to rellis` through its lists, and compares it with the data set.

    python read_rellis.py DATASET CONVERTED

Needs numpy, pillow. The data set has the paper's classes.
"""

import json
import re
import sys
from pathlib import Path

import numpy as np
from common import cameras
from PIL import Image

# Background, Terrain, Traversable, Trunks, Canopy, Shrubs, Herbaceous, Rocks.
IDS = np.array([7, 1, 1, 4, 4, 19, 3, 34])


def pairs(file):
    return [line.split() for line in file.read_text().splitlines()]


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    for info in out.glob("*/camera_info.txt"):
        k = cameras(manifest, int(info.parent.name))[0]["intrinsics"]
        # The first pixel's centre is at (0, 0).
        assert np.allclose(np.loadtxt(info), [k["fx"], k["fy"], k["cx"] - 0.5, k["cy"] - 0.5])
    pictures = points = 0
    for split in ("train", "val", "test"):
        for picture, label in pairs(out / f"{split}.lst"):
            sequence = int(picture[:5])
            name = re.search(r"frame(\d+)-", picture)[1]
            source = dataset / "sequences" / f"{sequence:02}"
            classes = np.asarray(Image.open(source / "semantic" / f"{name}.png"))
            assert (np.asarray(Image.open(out / label)) == IDS[classes]).all()
            assert (out / picture).read_bytes() == (source / "image_2" / f"{name}.png").read_bytes()
            pictures += 1
        for scan, label in pairs(out / f"pt_{split}.lst"):
            source = dataset / "sequences" / f"{int(scan[:5]):02}"
            name = Path(scan).stem
            native = np.fromfile(source / "labels" / f"{name}.label", "<u4")
            found = np.fromfile(out / label, "<u4")
            expected = np.where(native & 0xFFFF == 0, 0, IDS[native & 0xFFFF])
            assert (found & 0xFFFF == expected).all() and (found >> 16 == native >> 16).all()
            bytes_ = (source / "velodyne" / f"{name}.bin").read_bytes()
            assert (out / scan).read_bytes() == bytes_
            points += len(found)
    print(f"rellis: {pictures} pictures, {points} points equal")


main(*sys.argv[1:])
