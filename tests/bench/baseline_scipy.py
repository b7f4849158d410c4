#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What the released code of IMoS does, in its own tools: SciPy's least_squares with forward
differences for the object, then 160 steps of Adam for the fingers.

usage: baseline_scipy.py SCENE.npz [--frames N] [--double]

As solver/recipes/imos_code.h, whose results it is there to confirm. Prints milliseconds and energy
(of the paper's terms) per frame as JSON.
"""
import argparse
import time

import numpy as np
import scipy
import torch
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from bench_scene import Judge, Scene, exp, from_6d, log, report, to_6d

parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
parser.add_argument("scene")
parser.add_argument("--frames", type=int, default=10**9)
parser.add_argument("--double", action="store_true", help="in double precision (theirs: single)")
options = parser.parse_args()

STEPS, RATE, DECAY, WEIGHT, TAU = 160, 5e-3, 0.99999, 0.005, 0.01
dtype, np_dtype = (torch.float64, np.float64) if options.double else (torch.float32, np.float32)
torch.set_num_threads(1)  # tensors this small do not gain by more, and lose where cores are busy
scene, judge = Scene(options.scene, dtype), Judge(options.scene)
target, rest = scene.object.numpy(), judge.rest.T.to(dtype).numpy()  # object index first
start = exp(scene.fingers)
x = to_6d(start).clone().requires_grad_()
adam = torch.optim.Adam([x], lr=RATE)  # its moments go on from frame to frame
pose = np.concatenate([Rotation.from_matrix(scene.orientation.double().numpy()).as_rotvec(), scene.translation.numpy()])
ms, energies, evaluations = [], [], 0
for frame in range(1, min(scene.num_frames, options.frames) + 1):
    begin = time.perf_counter()
    v0 = scene.vertices(frame, start).detach()
    hand = v0.numpy()

    def residuals(p):
        posed = (Rotation.from_rotvec(p[:3]).apply(target) + p[3:]).astype(np_dtype)
        return (np.linalg.norm(posed[:, None] - hand[None], axis=2) - rest).ravel()

    found = least_squares(residuals, pose)
    pose = found.x
    evaluations += found.nfev + 6 * found.njev
    R = torch.tensor(Rotation.from_rotvec(pose[:3]).as_matrix(), dtype=dtype)
    T = torch.tensor(pose[3:], dtype=dtype)
    points = scene.object @ R.T + T

    def nearest(v):
        return points[torch.cdist(points, v).argmin(0)] - v

    near0 = nearest(v0)
    weight = torch.exp(-2 * near0.norm(dim=1, keepdim=True))
    with torch.no_grad():
        x.copy_(to_6d(start))
    for step in range(STEPS):
        adam.param_groups[0]["lr"] = RATE * DECAY**step
        adam.zero_grad()
        local = from_6d(x)
        v = scene.vertices(frame, local)
        loss = ((weight * (nearest(v) - near0)) ** 2).mean() + WEIGHT * ((v - v0) ** 2).mean()
        sample = torch.cdist(points, v).flatten()[:: len(points)]
        if (sample < TAU).any():
            loss = loss + WEIGHT * sample[sample < TAU].mean()
        used = local.detach()
        loss.backward()
        adam.step()  # of the last step nothing is used
    ms.append(1e3 * (time.perf_counter() - begin))
    energies.append(judge.energy(frame, R, T, log(used)))
report(ms, energies, evaluations_per_frame=evaluations / len(ms), scipy=scipy.__version__)
