# SPDX-License-Identifier: MIT
"""Opens a clip exported as .glb in Blender, alone in the scene, at its frame rate:

    blender -P open_in_blender.py -- held.glb [FRAMES_PER_SECOND]
"""
import sys

import bpy
import numpy

# The importer of Debian 12's Blender 3.4 asks for a name that numpy 1.24 has no more.
if "bool" not in vars(numpy):
    numpy.bool = bool

path, *rate = sys.argv[sys.argv.index("--") + 1:]
for thing in list(bpy.data.objects):  # the start-up scene's cube, camera and light
    bpy.data.objects.remove(thing)
scene = bpy.context.scene
scene.render.fps = int(rate[0]) if rate else 30
bpy.ops.import_scene.gltf(filepath=path)
ends = [action.frame_range[1] for action in bpy.data.actions]
scene.frame_start, scene.frame_end = 0, int(max(ends, default=0))
scene.frame_set(0)
print("objects:", ", ".join(f"{thing.name} ({thing.type.lower()})" for thing in scene.objects))
