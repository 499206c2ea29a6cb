"""Reads `nodes.glb` by trimesh, and compares all triangles with the truth: read_trimesh.py OUT

Needs trimesh, numpy, pillow, scipy. trimesh does not know EXT_mesh_gpu_instancing, so it reads the
file whose instances are nodes.
"""

import json
import sys
from pathlib import Path

import numpy as np
import trimesh

from common import compare, glb_json, truth


def main(out):
    path = Path(out) / "nodes.glb"
    scene = trimesh.load(path, process=False)
    # Names are trimesh's own; ids are in the extras of a node or of the node above it.
    graph, rows, labels = scene.graph, [], []
    y_up_to_z_up = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=float)
    for node in graph.nodes_geometry:
        matrix, name = graph[node]
        mesh = scene.geometry[name]
        points = trimesh.transform_points(mesh.vertices, matrix) @ y_up_to_z_up.T
        rows.append(points[mesh.faces])
        material = mesh.visual.material
        semantic = mesh.metadata.get("semantic") or SEMANTIC[material.name]
        labels += [(object_of(graph, node), semantic)] * len(mesh.faces)
    worst = compare("trimesh", (np.concatenate(rows), labels), truth(out))
    ids = {o for o, _ in labels if o}
    document = json.loads(glb_json(path))
    listed = {int(o["object"]) for o in document["scenes"][0]["extras"]["objects"]}
    assert ids == listed, (len(ids), len(listed))
    print(f"trimesh {trimesh.__version__}: {len(labels)} triangles, {len(ids)} objects, "
          f"{worst * 1000:.3f} mm off at most")


def object_of(graph, node):
    while node is not None:
        parent = graph.transforms.parents.get(node)
        edge = graph.transforms.edge_data.get((parent, node), {})
        extras = (edge.get("metadata") or {}) if edge else {}
        extras = extras.get("extras", extras)
        if "object" in extras:
            return int(extras["object"])
        node = parent
    return 0


out = sys.argv[1]
document = json.loads(glb_json(Path(out) / "nodes.glb"))
SEMANTIC = {m["name"]: m["extras"]["semantic"] for m in document["materials"]}
main(out)
