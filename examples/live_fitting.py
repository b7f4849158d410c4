# SPDX-License-Identifier: MIT
"""Fits an object frame by frame, as a live program does: poses come in, object and fingers go out.

Here the poses are those of an embedded motion; a tracker gives them in their place.
"""
import argparse
import time

import numpy as np

import holdfast

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--frames", type=int, default=None)
arguments = parser.parse_args()

motion = holdfast.Clip.load("demo_drink")[: arguments.frames]
start = holdfast.fit(motion[:10], "mug", hand="right").clip  # a grasp in the first frame

assert start.object
fitter = holdfast.FrameFitter("mug", "right", betas=motion.betas, frame_rate=motion.frame_rate)
fitter.start(start.poses[0], start.trans[0], start.object.orient[0], start.object.trans[0])
milliseconds: list[float] = []
translation = start.object.trans[0]
for poses, trans in zip(motion.poses[1:], motion.trans[1:]):
    begin = time.perf_counter()
    rotation, translation, fingers = fitter.step(poses, trans)
    milliseconds.append(1e3 * (time.perf_counter() - begin))
print(f"the mug is at {translation.round(3)} m in the last frame: {fitter.report['stop']}")
print(f"{np.median(milliseconds):.2f} ms a frame, {max(milliseconds):.2f} ms at most")
