# SPDX-License-Identifier: MIT
"""The two stages of IMoS's released code in NumPy and SciPy, written from its description.

usage: imos_code_reference.py SCENE.npz    (one JSON object on stdout)
"""
import json
import sys

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

scene = np.load(sys.argv[1])
hand, target, rest = scene["hand"], scene["object"], scene["distances"]  # (N,3) (M,3) (M,N)


def distances(points, vertices):
    return np.linalg.norm(points[:, None] - vertices[None], axis=2)


def residuals(p):
    posed = Rotation.from_rotvec(p[:3]).apply(target) + p[3:]
    return (distances(posed, hand) - rest).ravel()


found = least_squares(residuals, scene["start"])  # forward differences, trust region reflective


def vectors(vertices, points):
    return points[distances(points, vertices).argmin(axis=0)] - vertices


def loss(vertices, start, points, lambda_contact, lambda_drift, tau):
    before, now = vectors(start, points), vectors(vertices, points)
    weight = np.exp(-2 * np.linalg.norm(before, axis=1, keepdims=True))
    total = np.mean((weight * (now - before)) ** 2)
    sample = distances(points, vertices).ravel()[:: len(points)]
    if (sample < tau).any():
        total += lambda_contact * sample[sample < tau].mean()
    return total + lambda_drift * np.mean((vertices - start) ** 2)


json.dump(
    {
        "cost": found.cost,
        "rotation": Rotation.from_rotvec(found.x[:3]).as_matrix().tolist(),
        "translation": found.x[3:].tolist(),
        "loss": loss(scene["fingers"], hand, scene["posed"], 0.005, 0.005, 0.01),
        "loss_apart": loss(scene["fingers"], hand, scene["posed"] + 1.0, 0.005, 0.005, 0.01),
    },
    sys.stdout,
)
