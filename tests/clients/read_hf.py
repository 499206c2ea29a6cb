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
    loaded = datasets.load_dataset(str(out))
    own = {s["number"]: s.get("split") for s in manifest["sequences"]}
    names = {None: "train", "train": "train", "val": "validation", "test": "test"}
    assert set(loaded) == {names[split] for split in own.values()}, loaded
    expected = sum(len(cameras(manifest, f["sequence"])) for f in manifest["frames"])
    rows = [(split, row) for split, part in loaded.items() for row in part]
    assert len(rows) == expected, (len(rows), expected)
    for part in loaded.values():
        columns = {n for n, f in part.features.items() if isinstance(f, datasets.Image)}
        assert columns == {"image", "semantic", "instance", "depth", "normals"}, part.features
    for split, row in rows:
        assert names[own[row["sequence"]]] == split
        lens = cameras(manifest, row["sequence"])
        lens = next(c["intrinsics"] for c in lens if c["name"] == row["camera"])
        lens = lens.get("distortion", {"model": "none"})
        assert row["lens"] == {"none": "pinhole"}.get(lens["model"], lens["model"])
        assert row["distortion"][0] == lens.get("k1", 0) and len(row["distortion"]) == 5
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
    print(f"hf: {len(rows)} rows equal; Croissant: 0 errors, "
          f"{len(metadata.ctx.issues.warnings)} warnings {sorted(metadata.ctx.issues.warnings)}")
    part_of = {name: f"-{name}" if any(own.values()) else "" for name in loaded}
    parts = part_of.values()
    croissant = mlcroissant.Dataset(jsonld=str(out / "croissant.json"))
    described = {}
    for part in parts:
        records = list(croissant.records(f"pictures{part}"))
        by_path = {r[f"pictures{part}/file_name"]: r for r in records}
        described |= {(part, path): r for path, r in by_path.items()}
        for map_ in ("image", "semantic", "instance", "depth", "normals"):
            column = "file_name" if map_ == "image" else f"{map_}_file_name"
            listed = {r[f"pictures{part}/{column}"] for r in records}
            pictures = {r[f"{map_}{part}/path"]: r for r in croissant.records(f"{map_}{part}")}
            assert pictures.keys() == listed, map_
            content = next(iter(pictures.values()))[f"{map_}{part}/content"]
            assert isinstance(content, Image.Image)
    assert len(described) == expected
    for split, row in rows:
        part = part_of[split]
        path = f"{row['sequence']:02}/image/{row['frame']:06}_{row['camera']}.png".encode()
        record = described[part, path]
        for column in ("distortion", "world_from_camera"):
            # Its JSON's last digits are not exact.
            assert np.allclose(record[f"pictures{part}/{column}"], row[column]), column


main(*sys.argv[1:])
