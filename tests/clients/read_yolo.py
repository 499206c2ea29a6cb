"""Reads `nemoral convert --to yolo` by numpy and PyYAML, and compares it with the instance maps.

    python read_yolo.py DATASET CONVERTED

Needs numpy, pillow, pyyaml.
"""

import json
import sys
from pathlib import Path

import numpy as np
import yaml
from common import kinds
from PIL import Image


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    data = yaml.safe_load((out / "data.yaml").read_text())
    manifest = json.loads((dataset / "dataset.json").read_text())
    frames = {(f["sequence"], f["index"]): f for f in manifest["frames"]}
    folders = sorted({*data["train"], *data["val"], *data.get("test", [])})
    assert all(any((out / folder).iterdir()) for folder in folders)
    pictures = boxes = 0
    for folder in folders:
        for picture in sorted((out / folder).glob("*.png")):
            frame, camera = picture.stem.split("_", 1)
            source = dataset / "sequences" / picture.parent.name
            kind_of = kinds(dataset, frames[int(picture.parent.name), int(frame)])
            if (source / camera).exists():
                source = source / camera
            rgb = np.asarray(Image.open(source / "instance" / f"{frame}.png")).astype(np.uint32)
            map_ = rgb[..., 0] + 256 * rgb[..., 1] + 65536 * rgb[..., 2]
            height, width = map_.shape
            expected = []
            for id_ in np.unique(map_[map_ > 0]):
                rows, columns = np.nonzero(map_ == id_)
                box = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
                expected.append((kind_of[int(id_)], *map(int, box)))
            found = []
            label = Path(str(picture).replace("/images/", "/labels/")).with_suffix(".txt")
            for line in label.read_text().splitlines():
                kind, x, y, w, h = map(float, line.split())
                edges = np.array([x - w / 2, y - h / 2, x + w / 2, y + h / 2])
                pixels = edges * [width, height, width, height]
                assert abs(pixels - pixels.round()).max() < 1e-6
                found.append((data["names"][int(kind)], *(int(v) for v in pixels.round())))
            assert sorted(found) == sorted(expected), picture
            pictures += 1
            boxes += len(found)
    print(f"yolo: {pictures} pictures, {boxes} boxes equal")


main(*sys.argv[1:])
