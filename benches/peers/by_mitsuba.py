"""The hall by Mitsuba's path integrator: python by_mitsuba.py SAMPLES OUT.exr; prints seconds of a second frame.

Needs mitsuba (PyPI).
"""
import pathlib
import sys
import tempfile
import time

import mitsuba

import hall

mitsuba.set_variant("scalar_rgb")
samples, out = int(sys.argv[1]), sys.argv[2]
transform = mitsuba.ScalarTransform4f
width, height = hall.RESOLUTION
scene = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 18, "rr_depth": 100},
    "sensor": {
        "type": "perspective",
        "fov": hall.VERTICAL_FOV,
        "fov_axis": "y",
        "to_world": transform().look_at(list(hall.POSITION), list(hall.LOOK_AT), [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": samples},
    },
}
positions, polygons = hall.faces()
folder = tempfile.TemporaryDirectory()
for name, faces in polygons.items():
    # Mitsuba gives all of a file one material.
    file = pathlib.Path(folder.name) / f"{name}.obj"
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in positions)
    file.write_text(vertices + "".join("f " + " ".join(str(index + 1) for index in face) + "\n" for face in faces))
    colour = {"type": "rgb", "value": list(hall.materials()[name])}
    scene[f"mesh {name}"] = {
        "type": "obj",
        "filename": str(file),
        "face_normals": True,
        "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": colour}},
    }
for number, position in enumerate(hall.LAMPS):
    scene[f"lamp {number}"] = {
        "type": "point",
        "position": list(position),
        "intensity": {"type": "rgb", "value": list(hall.INTENSITY)},
    }
scene = mitsuba.load_dict(scene)
for seed in range(1 if samples > 256 else 2):
    start = time.monotonic()
    image = mitsuba.render(scene, seed=seed)
    seconds = time.monotonic() - start
mitsuba.util.write_bitmap(out, image)
print(f"mitsuba {mitsuba.__version__}, {samples} samples: {seconds:.2f} s")
