"""Reads `nemoral convert --to webdataset` by webdataset, and compares it with the data set.

    python read_webdataset.py DATASET CONVERTED

Needs numpy, pillow, webdataset.
"""

import json
import sys
from pathlib import Path

import numpy as np
import webdataset as wds
from common import cameras, lidars, metres
from PIL import Image


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    names = {str(c["id"]): c["name"] for c in manifest["ontology"]["classes"]}
    frames = {(f["sequence"], f["index"]): f for f in manifest["frames"]}
    shards = sorted(str(p) for p in out.glob("*.tar"))
    samples = points = 0
    for sample in wds.WebDataset(shards, shardshuffle=False).decode("rgb8"):
        info = sample["json"]
        frame = frames.pop((info["sequence"], info["frame"]))
        assert info["time_s"] == frame["time_s"]
        assert np.allclose(info["world_from_body"], frame["world_from_body"], atol=1e-9)
        assert info["classes"] == names
        name = f"{frame['index']:06}"
        source = dataset / "sequences" / f"{frame['sequence']:02}"
        for i, camera in enumerate(cameras(manifest, frame["sequence"])):
            key, folder = camera["name"], source if i == 0 else source / camera["name"]
            for map_ in ("instance", "normals"):
                native = np.asarray(Image.open(folder / map_ / f"{name}.png"))
                assert (sample[f"{key}.{map_}.png"] == native).all(), map_
            assert sample[f"{key}.rgb.png"].shape == native.shape
            # Numbers of the palette, which RGB would have as colours.
            native = np.asarray(Image.open(folder / "semantic" / f"{name}.png"))
            assert (sample[f"{key}.semantic.png"] == native[..., None]).all()
            said, k = info["cameras"][i], camera["intrinsics"]
            model = k.get("distortion", {"model": "none"})["model"]
            assert said["lens"] == {"none": "pinhole"}.get(model, model)
            assert (said["cx"], said["cy"]) == (k["cx"], k["cy"])
            depth = folder / "depth" / name
            if depth.with_suffix(".npy").exists():
                truth = np.load(depth.with_suffix(".npy"))
            else:
                truth = metres(Image.open(depth.with_suffix(".png")))
            assert (sample[f"{key}.depth.npy"] == truth.astype(np.float32)).all()
        for i, lidar in enumerate(lidars(manifest, frame["sequence"])):
            key, folder = lidar["name"], source if i == 0 else source / lidar["name"]
            scan = np.fromfile(folder / "velodyne" / f"{name}.bin", "<f4").reshape(-1, 4)
            labels = np.fromfile(folder / "labels" / f"{name}.label", "<u2").reshape(-1, 2)
            assert (sample[f"{key}.points.npy"] == scan).all()
            assert (sample[f"{key}.labels.npy"] == labels).all()
            points += len(scan)
        samples += 1
    assert not frames, "all frames are there"
    print(f"webdataset: {samples} samples, {points} points equal")


main(*sys.argv[1:])
