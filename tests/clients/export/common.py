"""What the clients of `nemoral export` share: the truth, and how triangles are compared with it."""

import json
import struct
from collections import Counter
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

# How far a vertex may be from ours, metres.
TOLERANCE_M = 1e-3


def semantics(out):
    """Names of fine semantics by their numbers, as a glTF file of the same scene has them."""
    materials = json.loads(glb_json(Path(out) / "nodes.glb"))["materials"]
    return {m["extras"]["semantic_id"]: m["extras"]["semantic"] for m in materials}


def classes(out):
    """Class and semantic of each material, and the table of classes."""
    document = json.loads(glb_json(Path(out) / "nodes.glb"))
    of = {m["extras"]["semantic"]: m["extras"]["class"] for m in document["materials"]}
    table = document["scenes"][0]["extras"]["classes"]
    return of, {c["name"]: c["id"] for c in table}


def glb_json(path):
    with open(path, "rb") as file:
        magic, version, _, length, kind = struct.unpack("<4sII I4s", file.read(20))
        assert (magic, version, kind) == (b"glTF", 2, b"JSON")
        return file.read(length)


def truth(out):
    """Triangles, (object, semantic) of each."""
    out = Path(out)
    corners = np.fromfile(out / "truth.f32", np.float32).reshape(-1, 3, 3).astype(np.float64)
    labels = np.fromfile(out / "truth.u64", np.uint64).reshape(-1, 2)
    names = semantics(out)
    return corners, [(int(o), names[int(s)]) for o, s in labels]


def compare(name, found, expected):
    """Triangles with labels are the same set: as many of each label, each corner of ours at one of
    theirs and the other way round. Returns the farthest distance, metres."""
    (corners, labels), (ours, our_labels) = found, expected
    counts, our_counts = Counter(labels), Counter(our_labels)
    differ = {k: (counts[k], our_counts[k]) for k in counts | our_counts if counts[k] != our_counts[k]}
    assert not differ, f"{name}: triangles of {len(differ)} labels differ: {list(differ.items())[:5]}"
    by_label = {}
    for side, all_labels in enumerate((labels, our_labels)):
        for i, label in enumerate(all_labels):
            by_label.setdefault(label, ([], []))[side].append(i)
    worst = 0.0
    for mine, theirs in by_label.values():
        # A triangle is its three corners, wherever it begins.
        a, b = canonical(corners[mine]), canonical(ours[theirs])
        worst = max(worst, cKDTree(a).query(b)[0].max(), cKDTree(b).query(a)[0].max())
    assert worst < TOLERANCE_M, f"{name}: a corner is {worst * 1000:.2f} mm off"
    return worst


def canonical(triangles):
    """Corners and middles: a triangle's own are near each other in all three."""
    middles = triangles.mean(axis=1, keepdims=True)
    return np.concatenate([triangles, middles], axis=1).reshape(-1, 3)
