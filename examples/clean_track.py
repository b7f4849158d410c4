# SPDX-License-Identifier: MIT
"""Cleans a noisy object trajectory: noise is put on a fitted one, and taken off again.

With captured data, load the clip (holdfast.Clip.load) and begin at refine().
"""
import argparse

import numpy as np

import holdfast

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--noise_mm", type=float, default=2.0)
parser.add_argument("--frames", type=int, default=60)
arguments = parser.parse_args()

truth = holdfast.fit(holdfast.Clip.load("demo_drink")[: arguments.frames], "mug").clip
noisy = truth.copy()
assert truth.object and noisy.object
right = truth.object.trans
random = np.random.default_rng(1)
noisy.object.trans[:] += 1e-3 * arguments.noise_mm * random.standard_normal((len(noisy), 3))

refined = holdfast.refine(noisy, "mug", hand="clip")


def error_mm(clip: holdfast.Clip) -> float:
    """RMS distance of the object from where it was."""
    assert clip.object
    return 1e3 * float(np.linalg.norm(clip.object.trans - right)) / len(clip) ** 0.5


print(f"{'':32s}{'noisy':>12s}{'refined':>12s}")
print(f"{'error, mm':32s}{error_mm(noisy):12.2f}{error_mm(refined.clip):12.2f}")
for name in ("max_penetration_depth_mm", "object_acceleration_m_s2"):
    print(f"{name:32s}{refined.before[name]:12.2f}{refined.after[name]:12.2f}")
