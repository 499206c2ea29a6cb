"""Renders an exported frame by Blender's Cycles, through the camera of the file:
render_blender.py SCENE.glb PICTURE.png [AZIMUTH ELEVATION [SAMPLES]]

The sun's azimuth is clockwise from north, its elevation above the horizon, both in degrees. Needs
bpy.
"""

import math
import sys

import bpy
from mathutils import Vector


def main(path, picture, azimuth="180", elevation="45", samples="32"):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    scene = bpy.context.scene
    scene.camera = next(o for o in scene.objects if o.type == "CAMERA")
    about = scene.camera.data
    scene.render.resolution_x = int(about.get("width_px", 640))
    scene.render.resolution_y = int(about.get("height_px", 360))
    azimuth, elevation = math.radians(float(azimuth)), math.radians(float(elevation))
    towards = Vector((math.sin(azimuth) * math.cos(elevation),
                      math.cos(azimuth) * math.cos(elevation), math.sin(elevation)))
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = 4.0, math.radians(0.53)
    lamp = bpy.data.objects.new("sun", sun)
    lamp.rotation_euler = towards.to_track_quat("Z", "Y").to_euler()
    scene.collection.objects.link(lamp)
    world = bpy.data.worlds.new("sky")
    scene.world = world
    world.use_nodes = True
    sky = world.node_tree.nodes["Background"]
    sky.inputs["Color"].default_value = (0.55, 0.7, 1.0, 1.0)
    sky.inputs["Strength"].default_value = 0.9
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = int(samples)
    scene.cycles.use_denoising = False
    scene.cycles.transparent_max_bounces = 32
    scene.render.filepath = picture
    scene.view_settings.view_transform = "Standard"
    bpy.ops.render.render(write_still=True)


main(*sys.argv[1:])
