"""Reads the height map by Pillow, and compares it with the ground's heights: read_height_map.py OUT

Needs numpy, pillow.
"""

import sys
import tomllib
from pathlib import Path

import numpy as np
from PIL import Image


def main(out):
    out = Path(out)
    about = tomllib.loads((out / "ground.toml").read_text())
    levels = np.asarray(Image.open(out / "ground.png"))
    assert levels.shape == (about["rows"], about["columns"]) and levels.max() == 65535
    heights = about["lowest_m"] + about["metres_per_level"] * levels.astype(np.float64)
    # The first row is the northernmost; ours are from south to north.
    ours = np.fromfile(out / "heights.f32", np.float32).reshape(levels.shape)[::-1]
    worst = np.abs(heights - ours).max()
    assert worst < 1e-3, worst
    print(f"height map by Pillow: {levels.shape[1]} x {levels.shape[0]} posts, "
          f"{worst * 1000:.3f} mm off at most")


main(sys.argv[1])
