"""Checks data sets in which all trees are the tree of make_tree.py: check.py FOLDER

FOLDER has truth.json and, for each file of the tree, a data set that was made of it. Needs numpy.
"""

import csv
import glob
import json
import os
import sys

import numpy as np

STEM, LEAF = 9, 18


def check(folder, truth):
    sequence = os.path.join(folder, "sequences", "00")
    with open(os.path.join(sequence, "trees.csv"), encoding="utf-8") as file:
        trees = [row for row in csv.DictReader(file)]
    models = [row for row in trees if row["species"] == "blender_tree"]
    assert len(models) == len(trees) > 100, (len(models), len(trees))
    for row in models:
        # Copies are from 0.9 to 1.1 times as large.
        scale = float(row["height_m"]) / truth["height_m"]
        assert 0.89 < scale < 1.11, row
        assert abs(float(row["dbh_m"]) / truth["dbh_m"] / scale - 1) < 0.05, row
        assert abs(float(row["leaf_area_m2"]) / truth["leaf_area_m2"] / scale**2 - 1) < 0.05, row
    ids = {int(row["id"]) for row in models}
    points = 0
    for name in sorted(glob.glob(os.path.join(sequence, "points", "*.ply"))):
        with open(name, "rb") as file:
            header, types = b"", []
            while not header.endswith(b"end_header\n"):
                header += file.readline()
            names = {"float": "<f4", "double": "<f8", "uchar": "u1", "ushort": "<u2", "uint": "<u4",
                     "int": "<i4", "char": "i1", "short": "<i2"}
            for line in header.decode().splitlines():
                word = line.split()
                if word[0] == "property":
                    types.append((word[2], names[word[1]]))
            cloud = np.frombuffer(file.read(), dtype=types)
        semantic = cloud["semantic"]
        points += int(np.isin(semantic, (STEM, LEAF)).sum())
        assert (semantic == STEM).sum() > 50 and (semantic == LEAF).sum() > 50, name
    print(f"{os.path.basename(folder)}: {len(ids)} trees in the inventory, {points} points on them")


def main(folder):
    with open(os.path.join(folder, "truth.json"), encoding="utf-8") as file:
        truth = json.load(file)
    for name in ("glb", "gltf", "obj"):
        check(os.path.join(folder, name), truth)


main(sys.argv[1])
