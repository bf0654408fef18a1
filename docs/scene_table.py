#!/usr/bin/env python3
"""Renders every model of a folder as it is and prints the table of docs/scenes.md.

    docs/scene_table.py target/release/lightmesh FOLDER [--backend bvh]

Needs nothing but Python 3. Further arguments go to `lightmesh render`. Folders named `awkward` are left out.
"""

import json
import os
import subprocess
import sys
import tempfile

MODELS = (".glb", ".gltf", ".obj", ".ply")


def models(folder):
    for path, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if name != "awkward")
        yield from (os.path.join(path, name) for name in sorted(files) if name.endswith(MODELS))


def row(program, model, arguments, scratch):
    stats = os.path.join(scratch, "stats.json")
    picture = os.path.join(scratch, "picture.png")
    child = subprocess.Popen([program, "render", "-q", model, "-o", picture, "--stats", stats, *arguments])
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    name = os.path.basename(model)
    if child.returncode != 0:
        return f"| {name} | not rendered |" + " |" * 10
    with open(stats) as file:
        s = json.load(file)
    seconds = s["seconds"]
    stages = [f"{seconds[stage]:.2f}" for stage in ("load", "build", "view", "paths", "mesh", "shade")]
    return "| " + " | ".join([
        name,
        f"{s['triangles']:,}",
        f"{s['unique_triangles']:,}",
        str(s["lights"]),
        *stages,
        f"{usage.ru_utime + usage.ru_stime:.1f}",
        f"{s['mesh_points']['direct']['evaluated']:,}",
        f"{s['peak_rss_bytes'] / 1e6:.0f}",
    ]) + " |"


def main():
    program, folder, *arguments = sys.argv[1:]
    print("| model | triangles | stored | lights | load | build | view | paths | mesh | shade | CPU | mesh points | MB |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as scratch:
        for model in models(folder):
            print(row(program, model, arguments, scratch), flush=True)


if __name__ == "__main__":
    main()
