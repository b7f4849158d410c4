# SPDX-License-Identifier: MIT
"""Reaching motions for random goals, as training data: one .npz of arrays for all of them.

A thousand take some minutes; the same --seed gives the same motions.
"""
import argparse

import numpy as np
from numpy.typing import NDArray

import holdfast

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--count", type=int, default=1000)
parser.add_argument("--seed", type=int, default=1)
parser.add_argument("--output", default="reaches.npz")
arguments = parser.parse_args()

random = np.random.default_rng(arguments.seed)
count: int = arguments.count
angle = random.uniform(-np.pi, np.pi, count)
distance = random.uniform(0.5, 2.5, count)
height = random.uniform(0.5, 1.6, count)
goals = np.stack([distance * np.cos(angle), distance * np.sin(angle), height], axis=1)

poses: list[NDArray[np.float64]] = []
trans: list[NDArray[np.float64]] = []
lengths: list[int] = []
reached: list[bool] = []
for k, goal in enumerate(goals):
    result = holdfast.reach(goal, samples=4, refit=False, seed=arguments.seed + k)
    poses.append(result.clip.poses)
    trans.append(result.clip.trans)
    lengths.append(len(result.clip))
    reached.append(bool(result.reached[0]))
    print(f"\r{k + 1} of {len(goals)}, {sum(reached)} reached", end="", flush=True)

np.savez_compressed(
    arguments.output,
    goals=goals,
    reached=reached,
    poses=np.concatenate(poses),  # of all motions, one after another
    trans=np.concatenate(trans),
    lengths=lengths,
)
print("\nsaved to", arguments.output)
