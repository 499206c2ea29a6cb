"""Reads `nemoral convert --to goose` by its names, and compares it with the data set.

    python read_goose.py DATASET CONVERTED

Needs numpy, pillow. The data set has the paper's classes.
"""

import csv
import sys
from pathlib import Path

import numpy as np
from PIL import Image

# Background, Terrain, Traversable, Trunks, Canopy, Shrubs, Herbaceous, Rocks.
IDS = np.array([53, 31, 24, 28, 27, 17, 50, 40])


def source_of(dataset, path):
    scene, rest = path.name.split("__")
    return dataset / "sequences" / scene.split("_")[1], f"{int(rest.split('_')[0]):06}"


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    with open(out / "goose_label_mapping.csv", newline="") as file:
        names = {int(r["label_key"]): r["class_name"] for r in csv.DictReader(file)}
    assert [names[i] for i in IDS[[3, 4, 7]]] == ["tree_trunk", "tree_crown", "rock"]
    pictures = points = 0
    for path in sorted(out.glob("images/*/*/*_windshield_vis.png")):
        source, name = source_of(dataset, path)
        assert path.read_bytes() == (source / "image_2" / f"{name}.png").read_bytes()
        stem = str(path).replace("/images/", "/labels/").removesuffix("_windshield_vis.png")
        classes = np.asarray(Image.open(source / "semantic" / f"{name}.png"))
        assert (np.asarray(Image.open(f"{stem}_labelids.png")) == IDS[classes]).all()
        native = np.asarray(Image.open(source / "instance" / f"{name}.png")).astype(np.uint32)
        native = native[..., 0] + 256 * native[..., 1] + 65536 * native[..., 2]
        found = np.asarray(Image.open(f"{stem}_instanceids.png"))
        pairs = set(zip(found.ravel().tolist(), native.ravel().tolist()))
        assert len(pairs) == len(np.unique(native)) == len(np.unique(found))
        pictures += 1
    for path in sorted(out.glob("velodyne/*/*/*_vls128.bin")):
        source, name = source_of(dataset, path)
        assert path.read_bytes() == (source / "velodyne" / f"{name}.bin").read_bytes()
        label = str(path).replace("/velodyne/", "/labels/").replace("_vls128.bin", "_goose.label")
        native = np.fromfile(source / "labels" / f"{name}.label", "<u4")
        found = np.fromfile(label, "<u4")
        expected = np.where(native & 0xFFFF == 0, 0, IDS[native & 0xFFFF])
        assert (found & 0xFFFF == expected).all() and (found >> 16 == native >> 16).all()
        points += len(found)
    print(f"goose: {pictures} pictures, {points} points equal")


main(*sys.argv[1:])
