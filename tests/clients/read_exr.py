"""Reads `nemoral convert --to exr` by OpenEXR's own library, and compares it with the depth.

    python read_exr.py DATASET CONVERTED

Needs numpy, OpenEXR, pillow.
"""

import json
import sys
from pathlib import Path

import numpy as np
import OpenEXR
from common import cameras, metres
from PIL import Image


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    pictures = hits = 0
    for frame in manifest["frames"]:
        number, name = frame["sequence"], f"{frame['index']:06}"
        for i, camera in enumerate(cameras(manifest, number)):
            # The first camera's folders are the sequence's own.
            folder = dataset / "sequences" / f"{number:02}" / ("" if i == 0 else camera["name"])
            depth = metres(Image.open(folder / "depth" / f"{name}.png"))
            with OpenEXR.File(str(out / f"{number:02}" / camera["name"] / f"{name}.exr")) as file:
                channels = file.channels()
                assert list(channels) == ["Z"], list(channels)
                found = channels["Z"].pixels
            assert found.dtype == np.float32 and found.shape == depth.shape
            assert (found == depth).all()
            pictures += 1
            hits += np.count_nonzero(depth)
    assert hits > 0, "no depth at all"
    print(f"exr: {pictures} depth maps equal, {hits} depths")


main(*sys.argv[1:])
