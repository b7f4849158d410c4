# SPDX-License-Identifier: MIT
"""Fits an object to a motion, measures and saves the result.

python3 fit_mug.py [CLIP [OBJECT [FOLDER]]]: without arguments an embedded mug in an embedded motion.
"""
import argparse

import holdfast


def show(stage: str, done: int, total: int) -> None:
    print(f"\r{stage} {done}/{total}  ", end="", flush=True)


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("clip", nargs="?", default="demo_drink")
parser.add_argument("object", nargs="?", default="mug")
parser.add_argument("folder", nargs="?", default="held")
parser.add_argument("--force", action="store_true", help="overwrite files in FOLDER")
arguments = parser.parse_args()

held = holdfast.fit(arguments.clip, arguments.object, progress=show)
print(f"\n{held} in {held.seconds:.1f} s")
for warning in held.warnings:
    print("warning:", warning)

values = holdfast.score(held.clip, held.object)["values"]
for name in ("penetration_max_mm", "intersection_volume_cm3", "contact_frames_ratio"):
    print(f"{name}: {values[name]:.4g}")

held.save(arguments.folder, force=arguments.force)
picture = arguments.folder + "/held.png"
holdfast.render(held.clip, picture, object=held.object, camera="hand", force=arguments.force)
print("saved to", arguments.folder)
