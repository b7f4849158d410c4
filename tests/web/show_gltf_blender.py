# SPDX-License-Identifier: MIT
"""blender -b -P show_gltf_blender.py -- FILE.glb: what Blender's importer makes of an exported clip
against frame_%04d.ply and frame_object_%04d.ply beside it (meters, z up, as Blender has it). Fails
beyond 0.1 mm in any frame, and for objects in the scene that nobody asked for."""
import glob
import sys

import bpy
import numpy

LIMIT_MM = 0.1
numpy.bool = bool  # Blender 3.4's importer asks for it, numpy 1.24 has it no more


def ply_vertices(path):
    data = open(path, "rb").read()
    header, body = data.split(b"end_header\n", 1)
    lines = header.decode().split("\n")
    assert "format binary_little_endian 1.0" in lines, path
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    assert [line for line in lines if line.startswith("property float")] == [
        "property float x", "property float y", "property float z"], path
    return numpy.frombuffer(body, "<f4", 3 * count).reshape(count, 3).astype(float)


def shown(name):
    """Vertices of an object as it stands in the scene now: morphed, skinned and placed."""
    graph = bpy.context.evaluated_depsgraph_get()
    thing = bpy.data.objects[name].evaluated_get(graph)
    mesh = thing.to_mesh()
    points = numpy.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", points)
    thing.to_mesh_clear()
    matrix = numpy.array(thing.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def nearest(points, among):
    return numpy.array([numpy.argmin(((among - p) ** 2).sum(axis=1)) for p in points])


def main():
    scene = bpy.context.scene
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene.render.fps = 30
    bpy.ops.import_scene.gltf(filepath=sys.argv[sys.argv.index("--") + 1])
    types = {thing.name: thing.type for thing in scene.objects}
    print("objects:", types)
    expected = {"body": "ARMATURE", "skin": "MESH", "mug": "MESH"}
    if types != expected:
        sys.exit(f"the scene should hold {expected}")

    frames = sorted(glob.glob("frame_[0-9]*.ply"))
    corners = None  # vertices split at creases, and which of the object's each of them is
    worst = {"skin": 0.0, "mug": 0.0}
    for frame, path in enumerate(frames):
        scene.frame_set(frame)
        skin = numpy.linalg.norm(shown("skin") - ply_vertices(path), axis=1).max()
        mug = ply_vertices(path.replace("frame_", "frame_object_"))
        if corners is None:
            corners = nearest(shown("mug"), mug)
        worst["skin"] = max(worst["skin"], 1e3 * skin)
        worst["mug"] = max(worst["mug"],
                           1e3 * numpy.linalg.norm(shown("mug") - mug[corners], axis=1).max())
    print(f"{len(frames)} frames, largest distance: skin {worst['skin']:.4f} mm, "
          f"mug {worst['mug']:.4f} mm")
    if not frames or max(worst.values()) >= LIMIT_MM:
        sys.exit(f"should be within {LIMIT_MM} mm")


main()
