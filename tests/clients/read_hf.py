"""Reads `nemoral convert --to hf` by datasets and mlcroissant, and compares it with the data set.

    python read_hf.py DATASET CONVERTED

Needs numpy, pillow, datasets, mlcroissant. Nothing is fetched.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

os.environ["HF_HUB_OFFLINE"] = "1"
os.environ["HF_HOME"] = tempfile.mkdtemp()

import datasets
import mlcroissant
import numpy as np
from common import cameras
from PIL import Image


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    loaded = datasets.load_dataset(str(out), split="train")
    expected = sum(len(cameras(manifest, f["sequence"])) for f in manifest["frames"])
    assert len(loaded) == expected, (len(loaded), expected)
    columns = {n for n, f in loaded.features.items() if isinstance(f, datasets.Image)}
    assert columns == {"image", "semantic", "instance", "depth", "normals"}, loaded.features
    for row in loaded:
        source = dataset / "sequences" / f"{row['sequence']:02}"
        first = cameras(manifest, row["sequence"])[0]["name"] == row["camera"]
        folder = source if first else source / row["camera"]
        name = f"{row['frame']:06}.png"
        for map_ in ("semantic", "instance", "normals"):
            native = Image.open(folder / map_ / name)
            assert row[map_].mode == native.mode
            assert (np.asarray(row[map_]) == np.asarray(native)).all(), map_
        if (folder / "depth" / name).exists():
            native = np.asarray(Image.open(folder / "depth" / name))
            assert (np.asarray(row["depth"]) == native).all()
        if first:
            native = Image.open(folder / "image_2" / name)
            assert (np.asarray(row["image"]) == np.asarray(native)).all()
    metadata = mlcroissant.Dataset(jsonld=str(out / "croissant.json")).metadata
    errors = sorted(metadata.ctx.issues.errors)
    assert not errors, errors
    print(f"hf: {len(loaded)} rows equal; Croissant: 0 errors, "
          f"{len(metadata.ctx.issues.warnings)} warnings {sorted(metadata.ctx.issues.warnings)}")
    records = mlcroissant.Dataset(jsonld=str(out / "croissant.json")).records("pictures")
    assert sum(1 for _ in records) == expected


main(*sys.argv[1:])
