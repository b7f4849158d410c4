#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The paper's joint problem as one would write it in PyTorch: torch.cdist, autograd, Adam.

usage: baseline_torch.py SCENE.npz ITERATIONS [--rate 5e-3] [--frames N]

Unknowns: the object's rotation (6D) and translation, 45 finger numbers (axis-angle). Each frame
starts where ours does: the last one's result, the object carried along by the wrist. Single
precision; one thread or all, whichever is faster. Prints milliseconds and energy per frame as JSON.
"""
import argparse
import os
import time

import torch

from bench_scene import Judge, Scene, exp, from_6d, report, to_6d

parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
parser.add_argument("scene")
parser.add_argument("iterations", type=int)
parser.add_argument("--rate", type=float, default=5e-3, help="Adam's learning rate (the authors': 5e-3)")
parser.add_argument("--frames", type=int, default=10**9)
options = parser.parse_args()

scene, judge = Scene(options.scene), Judge(options.scene)
rest, touching = judge.rest.float(), judge.rest < scene.tau
lambda_d, lambda_c, lambda_t = scene.lambdas


def fit(frame, R0, T0, fingers0, iterations):
    R, T = scene.follow_wrist(frame, R0, T0)
    x, t, p = (v.clone().requires_grad_() for v in (to_6d(R), T, fingers0))
    adam = torch.optim.Adam([x, t, p], lr=options.rate)
    for _ in range(iterations):
        adam.zero_grad()
        turned = from_6d(x)
        distance = torch.cdist(scene.vertices(frame, exp(p)), scene.object @ turned.T + t)
        loss = (
            lambda_d * ((distance - rest) ** 2).sum()
            + lambda_c * (distance[touching] ** 2).sum()
            + lambda_t
            * (((turned - R0) ** 2).sum() / 2 + ((t - T0) ** 2).sum() + ((p - fingers0) ** 2).sum())
        )
        loss.backward()
        adam.step()
    return from_6d(x).detach(), t.detach(), p.detach()


def timed(*arguments):
    begin = time.perf_counter()
    result = fit(*arguments)
    return 1e3 * (time.perf_counter() - begin), result


found = (scene.orientation, scene.translation, scene.fingers)
# One thread or all, whichever is faster here: tensors this small do not always gain by more.
trials = {}
for threads in {1, os.cpu_count() or 1}:
    torch.set_num_threads(threads)
    trials[threads] = min(timed(1, *found, 20)[0] for _ in range(3))
torch.set_num_threads(min(trials, key=trials.get))

ms, energies = [], []
for frame in range(1, min(scene.num_frames, options.frames) + 1):
    took, found = timed(frame, *found, options.iterations)
    ms.append(took)
    energies.append(judge.energy(frame, *found))
report(ms, energies, threads=torch.get_num_threads(), torch=torch.__version__)
