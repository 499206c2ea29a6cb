"""Imports both glTF files into Blender, and compares all triangles with the truth:
read_blender.py OUT

Needs bpy, numpy, scipy. Blender's importer makes objects of EXT_mesh_gpu_instancing, but gives them
no ids, so that ids are compared in the file whose instances are nodes.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

from common import compare, truth


def read(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    rows, labels = [], []
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        placed = instance.object
        if placed.type != "MESH" or not placed.data.polygons:
            continue
        mesh = placed.data
        matrix = np.array(instance.matrix_world, dtype=np.float64)
        points = np.empty(len(mesh.vertices) * 3, np.float32)
        mesh.vertices.foreach_get("co", points)
        points = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        mesh.calc_loop_triangles()
        corners = np.empty(len(mesh.loop_triangles) * 3, np.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
        slots = np.empty(len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("material_index", slots)
        rows.append(points[corners.reshape(-1, 3)])
        semantics = [material["semantic"] for material in mesh.materials]
        owner, object_id = placed.original, 0
        while owner is not None and not object_id:
            object_id = int(owner.get("object", 0))
            owner = owner.parent
        labels += [(object_id, semantics[slot]) for slot in slots]
    return np.concatenate(rows), labels


def main(out):
    expected = truth(out)
    version = bpy.app.version_string
    found = read(Path(out) / "nodes.glb")
    worst = compare("Blender, nodes", found, expected)
    ids = {o for o, _ in found[1] if o}
    print(f"Blender {version}, nodes: {len(found[1])} triangles, {len(ids)} objects, "
          f"{worst * 1000:.3f} mm off at most")
    nameless = lambda scene: (scene[0], [(0, semantic) for _, semantic in scene[1]])
    found = read(Path(out) / "instanced.glb")
    worst = compare("Blender, instanced", nameless(found), nameless(expected))
    print(f"Blender {version}, instanced: {len(found[1])} triangles, "
          f"{worst * 1000:.3f} mm off at most")


main(sys.argv[1])
