"""The hall by Cycles: python by_cycles.py SAMPLES [denoise] [OUT.exr]; prints seconds of a second frame.

Needs bpy (PyPI, Python 3.13) and, on Debian, libxrender1 libxi6 libxkbcommon0 libgl1 libsm6 libxxf86vm1 libxfixes3.
"""
import math
import sys
import time

import bpy
from mathutils import Vector

import hall


def turned(point):
    """Cycles' z is up."""
    x, y, z = point
    return Vector((x, -z, y))


samples, denoise, out = int(sys.argv[1]), "denoise" in sys.argv[2:], sys.argv[-1]
for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
scene = bpy.context.scene
positions, polygons = hall.faces()
for name, faces in polygons.items():
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([turned(position) for position in positions], [], faces)
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*hall.materials()[name], 1.0)
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new(name, mesh))
for number, position in enumerate(hall.LAMPS):
    lamp = bpy.data.lights.new(f"lamp {number}", "POINT")
    strength = max(hall.INTENSITY)
    lamp.energy = 4.0 * math.pi * strength
    lamp.color = [channel / strength for channel in hall.INTENSITY]
    lamp.shadow_soft_size = 0.0
    placed = bpy.data.objects.new(lamp.name, lamp)
    placed.location = turned(position)
    scene.collection.objects.link(placed)
camera = bpy.data.cameras.new("camera")
camera.sensor_fit, camera.angle = "VERTICAL", math.radians(hall.VERTICAL_FOV)
placed = bpy.data.objects.new("camera", camera)
placed.location = turned(hall.POSITION)
way = turned(hall.LOOK_AT) - turned(hall.POSITION)
placed.rotation_euler = way.to_track_quat("-Z", "Y").to_euler()
scene.collection.objects.link(placed)
scene.camera = placed

scene.render.engine = "CYCLES"
scene.render.resolution_x, scene.render.resolution_y = hall.RESOLUTION
scene.render.resolution_percentage = 100
scene.render.threads_mode, scene.render.threads = "FIXED", 2
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = out
cycles = scene.cycles
cycles.device, cycles.samples, cycles.use_adaptive_sampling = "CPU", samples, False
cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
cycles.max_bounces = cycles.diffuse_bounces = 16
cycles.pixel_filter_type = "BOX"
cycles.filter_width = 1.0
cycles.use_light_tree = True
cycles.use_denoising = denoise
scene.render.use_persistent_data = True
for _ in range(1 if samples > 256 else 2):
    start = time.monotonic()
    bpy.ops.render.render(write_still=True)
    seconds = time.monotonic() - start
print(f"cycles {bpy.app.version_string}, {samples} samples, denoise {denoise}: {seconds:.2f} s")
