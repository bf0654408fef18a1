"""The closed hall that lightmesh is compared with other renderers on: scenes/interior under 40 point lamps.

Needs numpy. `python hall.py HALL.toml` writes the scene file for lightmesh.
"""
import pathlib
import sys

import numpy

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "scenes" / "interior"
RESOLUTION = (320, 200)
POSITION, LOOK_AT, VERTICAL_FOV = (-2.6, 1.75, 11.4), (0.8, 1.5, 4.0), 55.0
# W/sr
INTENSITY = (4.0, 3.7, 3.2)
LAMPS = [(x, 3.9, z) for x in (-4.4, -2.2, 0.0, 2.2, 4.4) for z in (-10.5, -7.5, -4.5, -1.5, 1.5, 4.5, 7.5, 10.5)]


def materials():
    """k_d by name."""
    found, name = {}, None
    for line in (FOLDER / "interior.mtl").read_text().splitlines():
        words = line.split()
        if words[:1] == ["newmtl"]:
            name = words[1]
        elif words[:1] == ["Kd"]:
            found[name] = tuple(map(float, words[1:]))
    return found


def faces():
    """Positions, and by material the polygons as lists of their indices."""
    positions, polygons, name = [], {}, None
    for line in (FOLDER / "interior.obj").read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            positions.append(tuple(map(float, words[1:])))
        elif words[:1] == ["usemtl"]:
            name = words[1]
        elif words[:1] == ["f"]:
            indices = [int(word.split("/")[0]) for word in words[1:]]
            # Those below zero count from the last position so far.
            polygons.setdefault(name, []).append([i - 1 if i > 0 else len(positions) + i for i in indices])
    return positions, polygons


def write_pfm(path, image):
    """Linear RGB, rows from the top."""
    height, width, _ = image.shape
    with open(path, "wb") as file:
        file.write(f"PF\n{width} {height}\n-1.0\n".encode())
        file.write(numpy.ascontiguousarray(image[::-1], dtype="<f4").tobytes())


def scene_file():
    lines = ['preset = "physical"', "[camera]", f"position = {list(POSITION)}", f"look_at = {list(LOOK_AT)}"]
    lines += [f"vertical_fov = {VERTICAL_FOV}", "[render]", f"resolution = {list(RESOLUTION)}", "spp = 16"]
    lines += ["[[geometry]]", f'file = "{FOLDER / "interior.obj"}"']
    for lamp in LAMPS:
        lines += ["[[light]]", f"position = {list(lamp)}", f"intensity = {list(INTENSITY)}"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    pathlib.Path(sys.argv[1]).write_text(scene_file())
