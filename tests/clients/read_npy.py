"""Reads `nemoral convert --to npy` by NumPy, and compares it with the data set's depth.

    python read_npy.py DATASET CONVERTED

Needs numpy, pillow.
"""

import json
import sys
from pathlib import Path

import numpy as np
from common import metres
from PIL import Image


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    pictures = 0
    for frame in manifest["frames"]:
        number, name = frame["sequence"], f"{frame['index']:06}"
        sequence = next(s for s in manifest["sequences"] if s["number"] == number)
        for i, camera in enumerate(sequence["cameras"]):
            folder = dataset / "sequences" / f"{number:02}" / ("" if i == 0 else camera["name"])
            depth = metres(Image.open(folder / "depth" / f"{name}.png"))
            found = np.load(out / f"{number:02}" / camera["name"] / f"{name}.npy")
            assert found.dtype == np.float32 and (found == depth).all()
            pictures += 1
    print(f"npy: {pictures} depth maps equal")


main(*sys.argv[1:])
