"""Reads the Gazebo world: its XML, its looks by trimesh, its collisions: read_sdf.py OUT

Needs trimesh, numpy, pillow, scipy.
"""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from common import classes, compare, truth


def pose(element):
    """Position and rotation."""
    node = element.find("pose")
    numbers = [float(n) for n in node.text.split()]
    if node.get("rotation_format") == "quat_xyzw":
        return np.array(numbers[:3]), Rotation.from_quat(numbers[3:])
    assert numbers[3:] == [0, 0, 0]
    return np.array(numbers[:3]), Rotation.identity()


def placed(points, model, part, scale):
    (at, turn), (offset, inner) = pose(model), pose(part)
    return turn.apply(inner.apply(points * scale) + offset) + at


def main(out):
    folder = Path(out) / "sdf"
    world = ElementTree.parse(folder / "world.sdf").getroot().find("world")
    class_of, ids = classes(out)
    corners, labels = truth(out)
    expected = corners, [(o, class_of[s]) for o, s in labels]
    rows, found, files, counts = [], [], {}, dict(cylinders=0, meshes=0)
    for model in world.findall("model"):
        assert model.find("static").text == "true"
        kind, _, number = model.get("name").rpartition("_")
        object_id = int(number) if number.isdigit() else 0
        link = model.find("link")
        for visual in link.findall("visual"):
            name = visual.get("name").rpartition("_")[0]
            assert int(visual.find("plugin/label").text) == ids[name]
            uri = visual.find("geometry/mesh/uri").text
            if uri not in files:
                # Gazebo's reader applies the nodes of a file and turns nothing.
                files[uri] = trimesh.load(folder / uri, process=False).to_geometry()
            mesh = files[uri]
            scale = np.array([float(n) for n in visual.find("geometry/mesh/scale").text.split()])
            points = placed(mesh.vertices, model, visual, scale)
            rows.append(points[mesh.faces])
            found += [(object_id, name)] * len(mesh.faces)
        collisions = link.findall("collision")
        for collision in collisions:
            cylinder = collision.find("geometry/cylinder")
            counts["cylinders" if cylinder is not None else "meshes"] += 1
            if cylinder is None:
                solid = trimesh.load(folder / collision.find("geometry/mesh/uri").text,
                                     process=False)
                assert len(solid.faces) > 0
        assert kind != "tree" or collisions, model.get("name")
        assert kind != "shrub" or not collisions
    worst = compare("sdf", (np.concatenate(rows), found), expected)
    stems(world, corners, labels)
    print(f"SDF by trimesh: {len(found)} triangles of {len(files)} files, "
          f"{counts['cylinders']} cylinders, {counts['meshes']} collision meshes, "
          f"{worst * 1000:.3f} mm off at most")


def stems(world, corners, labels):
    """The cylinders of a tree lie along its stem."""
    of = {}
    for i, (object_id, semantic) in enumerate(labels):
        if semantic in ("stem", "root_flare", "snag") and object_id:
            of.setdefault(object_id, []).append(i)
    for model in world.findall("model"):
        kind, _, number = model.get("name").rpartition("_")
        if kind != "tree":
            continue
        surface = corners[of[int(number)]].reshape(-1, 3)
        gaps = []
        for collision in model.find("link").findall("collision"):
            at, turn = pose(model)[0] + pose(collision)[0], pose(collision)[1]
            radius = float(collision.find("geometry/cylinder/radius").text)
            length = float(collision.find("geometry/cylinder/length").text)
            local = turn.inv().apply(surface - at)
            near = local[np.abs(local[:, 2]) < length / 2]
            if len(near):
                gaps.append(np.abs(np.hypot(near[:, 0], near[:, 1]) - radius).mean() / radius)
        assert gaps and np.median(gaps) < 0.35, (number, gaps)


main(sys.argv[1])
