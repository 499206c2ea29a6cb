"""Reads `nemoral convert --to coco` by pycocotools, and compares it with the data set.

    python read_coco.py DATASET CONVERTED

Needs numpy, pillow, pycocotools.
"""

import json
import sys
from pathlib import Path

import numpy as np
from common import kinds
from PIL import Image
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval


def ids(path):
    rgb = np.asarray(Image.open(path)).astype(np.uint32)
    return rgb[..., 0] + 256 * rgb[..., 1] + 65536 * rgb[..., 2]


def check(dataset, frames, out, split):
    """Checks the lists of a split (`_train`), or of all; how many of what there are."""
    coco = COCO(str(out / f"instances{split}.json"))
    panoptic = json.loads((out / f"panoptic{split}.json").read_text())
    segments = {a["image_id"]: a for a in panoptic["annotations"]}
    classes = {c["id"]: c for c in panoptic["categories"]}
    names = {c["id"]: c["name"] for c in coco.loadCats(coco.getCatIds())}
    objects = parts = 0
    for image in coco.loadImgs(coco.getImgIds()):
        sequence, frame, camera = Path(image["file_name"]).stem.split("_", 2)
        folder = dataset / "sequences" / sequence
        kind_of = kinds(dataset, frames[int(sequence), int(frame)])
        if (folder / camera).exists():
            folder = folder / camera
        instance = ids(folder / "instance" / f"{frame}.png")
        semantic = np.asarray(Image.open(folder / "semantic" / f"{frame}.png"))
        found = np.zeros_like(instance)
        for a in coco.loadAnns(coco.getAnnIds(imgIds=image["id"])):
            mask = coco.annToMask(a).astype(bool)
            left, top, width, height = map(int, a["bbox"])
            box = (slice(top, top + height), slice(left, left + width))
            inside = mask[box]
            assert inside.shape == (height, width), a["id"]
            assert a["area"] == np.count_nonzero(mask) == np.count_nonzero(inside), a["id"]
            # The box is the least one.
            assert all(edge.any() for edge in (inside[0], inside[-1], inside[:, 0], inside[:, -1]))
            assert names[a["category_id"]] == kind_of[a["instance_id"]]
            assert not found[box][inside].any()
            found[box][inside] = a["instance_id"]
            objects += 1
        assert (found == instance).all(), image["file_name"]
        annotation = segments[image["id"]]
        map_ = ids(out / "panoptic" / annotation["file_name"])
        order = np.argsort(map_, axis=None, kind="stable")
        numbers, first = np.unique(map_.ravel()[order], return_index=True)
        pixels_of = dict(zip(numbers.tolist(), np.split(order, first[1:])))
        assert set(pixels_of) == {s["id"] for s in annotation["segments_info"]}
        for s in annotation["segments_info"]:
            pixels = pixels_of[s["id"]]
            assert s["area"] == len(pixels)
            assert (semantic.ravel()[pixels] == s["category_id"] - 1).all()
            assert (instance.ravel()[pixels] == s["instance_id"]).all()
            crowd = classes[s["category_id"]]["isthing"] and s["instance_id"] == 0
            assert s["iscrowd"] == int(crowd)
            parts += 1
    # The truth, found as such, has an average precision of 1.
    results = [
        {k: a[k] for k in ("image_id", "category_id", "segmentation", "bbox")} | {"score": 1.0}
        for a in coco.loadAnns(coco.getAnnIds())
    ]
    evaluation = COCOeval(coco, coco.loadRes(results), "segm")
    evaluation.params.maxDets = [1, 10, 1000]
    evaluation.evaluate()
    evaluation.accumulate()
    # Of all sizes, with all detections.
    precision = evaluation.eval["precision"][:, :, :, 0, -1]
    ap = precision[precision > -1].mean()
    assert ap == 1.0, ap
    return len(coco.imgs), objects, parts


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    frames = {(f["sequence"], f["index"]): f for f in manifest["frames"]}
    splits = [path.stem.removeprefix("instances") for path in sorted(out.glob("instances*.json"))]
    counts = np.sum([check(dataset, frames, out, split) for split in splits], axis=0)
    pictures, objects, parts = counts.tolist()
    print(f"coco: {pictures} pictures, {objects} objects, {parts} segments equal; AP 1.0")


main(*sys.argv[1:])
