"""Makes a tree in Blender, as an artist would, and exports it: make_tree.py FOLDER

A stem that tapers, boughs that are children of it, and leaves on planes whose picture's alpha cuts
them out. Writes tree.glb, which has all of it in one file, tree.gltf with its buffer and picture
beside it, and tree.obj with its materials; truth.json says how thick and high the tree is, and how
many leaves it has. Needs bpy.
"""

import json
import math
import os
import random
import sys

import bpy
from mathutils import Matrix, Vector

HEIGHT_M, FOOT_RADIUS_M, LEAVES, LEAF_M = 9.0, 0.18, 3000, 0.16


def material(name, colour):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*colour, 1.0)
    return made


def leaf_material(folder):
    side = 64
    picture = bpy.data.images.new("leaf", side, side, alpha=True)
    pixels = []
    for row in range(side):
        for column in range(side):
            u, v = (column + 0.5) / side - 0.5, (row + 0.5) / side
            inside = abs(u) < 0.42 * math.sin(math.pi * v) ** 0.8
            pixels += [0.24 + 0.06 * v, 0.33 + 0.06 * v, 0.14, 1.0 if inside else 0.0]
    picture.pixels = pixels
    picture.filepath_raw = os.path.join(folder, "leaf.png")
    picture.file_format = "PNG"
    picture.save()
    made = material("Leaf.Material", (0.1, 0.3, 0.05))
    nodes, links = made.node_tree.nodes, made.node_tree.links
    shader = nodes["Principled BSDF"]
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = picture
    links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    # What glTF calls MASK: alpha, rounded.
    cut = nodes.new("ShaderNodeMath")
    cut.operation = "GREATER_THAN"
    cut.inputs[1].default_value = 0.5
    links.new(texture.outputs["Alpha"], cut.inputs[0])
    links.new(cut.outputs[0], shader.inputs["Alpha"])
    return made


def tube(name, base, top, radii, made, parent=None):
    length = (top - base).length
    bpy.ops.mesh.primitive_cone_add(vertices=24, radius1=radii[0], radius2=radii[1], depth=length)
    made_object = bpy.context.object
    made_object.name = name
    turn = (top - base).to_track_quat("Z", "Y").to_matrix().to_4x4()
    made_object.matrix_world = Matrix.Translation((base + top) / 2) @ turn
    made_object.data.materials.append(made)
    if parent:
        kept = made_object.matrix_world.copy()
        made_object.parent = parent
        made_object.matrix_world = kept
    return made_object


def main(folder):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    draw = random.Random(5)
    bark = material("Bark.Material", (0.16, 0.11, 0.07))
    stem = tube("Stem", Vector((0, 0, -0.3)), Vector((0, 0, HEIGHT_M)), (FOOT_RADIUS_M, 0.02), bark)
    boughs = []
    for i in range(26):
        z = 2.6 + 6.0 * i / 26
        angle = 2.4 * i
        reach = 0.5 + 2.2 * (1.0 - z / (HEIGHT_M + 0.5))
        base = Vector((0, 0, z))
        top = base + reach * Vector((math.cos(angle), math.sin(angle), 0.35))
        tube(f"Bough.{i:02}", base, top, (0.03, 0.008), bark, stem)
        boughs.append((base, top))
    vertices, faces, uvs = [], [], []
    for _ in range(LEAVES):
        base, top = draw.choice(boughs)
        at = base.lerp(top, draw.uniform(0.25, 1.0))
        turn = Matrix.Rotation(draw.uniform(0, math.tau), 3, "Z")
        turn = turn @ Matrix.Rotation(draw.uniform(-0.9, 0.9), 3, "X")
        first = len(vertices)
        for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)):
            vertices.append(at + turn @ Vector((LEAF_M * (u - 0.5), LEAF_M * v, 0)))
            uvs.append((u, v))
        faces.append(tuple(range(first, first + 4)))
    mesh = bpy.data.meshes.new("Leaves")
    mesh.from_pydata(vertices, [], faces)
    layer = mesh.uv_layers.new(name="UVMap")
    for loop in mesh.loops:
        layer.data[loop.index].uv = uvs[loop.vertex_index]
    mesh.materials.append(leaf_material(folder))
    leaves = bpy.data.objects.new("Leaves", mesh)
    bpy.context.scene.collection.objects.link(leaves)
    leaves.parent = stem
    leaves.matrix_parent_inverse = stem.matrix_world.inverted()
    bpy.context.view_layer.update()
    bpy.ops.export_scene.gltf(filepath=os.path.join(folder, "tree.glb"), export_format="GLB")
    bpy.ops.export_scene.gltf(filepath=os.path.join(folder, "tree.gltf"),
                              export_format="GLTF_SEPARATE", export_texture_dir="textures")
    bpy.ops.wm.obj_export(filepath=os.path.join(folder, "tree.obj"), path_mode="RELATIVE")
    # OBJ does not say them; Blender's exporter turns to y up.
    with open(os.path.join(folder, "tree.obj.toml"), "w", encoding="utf-8") as sidecar:
        sidecar.write('up = "y"\nmetres_per_unit = 1.0\n')
    radius_m = FOOT_RADIUS_M + (0.02 - FOOT_RADIUS_M) * 1.6 / (HEIGHT_M + 0.3)
    area = sum(abs(0.42 * math.sin(math.pi * (i + 0.5) / 1000) ** 0.8) * 2 for i in range(1000)) / 1000
    truth = {"dbh_m": 2 * radius_m, "height_m": HEIGHT_M, "leaves": LEAVES,
             "leaf_area_m2": LEAVES * LEAF_M * LEAF_M * area}
    with open(os.path.join(folder, "truth.json"), "w", encoding="utf-8") as file:
        json.dump(truth, file)
    print(f"Blender {bpy.app.version_string}: {truth}")


main(sys.argv[1])
