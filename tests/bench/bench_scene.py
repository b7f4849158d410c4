# SPDX-License-Identifier: MIT
"""The benchmark's scene in PyTorch: the hand as a function of its fingers, and the energies.

Written by holdfast_fit_methods; read by baseline_torch.py and baseline_scipy.py.
"""
import json
import sys

import numpy as np
import torch


def exp(w):
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3)."""
    angle = torch.sqrt((w * w).sum(-1) + 1e-16)[..., None, None]
    x, y, z = w.unbind(-1)
    o = torch.zeros_like(x)
    K = torch.stack([o, -z, y, z, o, -x, -y, x, o], -1).reshape(*w.shape[:-1], 3, 3)
    return torch.eye(3, dtype=w.dtype) + torch.sin(angle) / angle * K + (
        1 - torch.cos(angle)
    ) / angle**2 * (K @ K)


def to_6d(R):
    return R[..., :2, :].reshape(*R.shape[:-2], 6)


def from_6d(x):
    """The authors' six numbers: the first two rows."""
    a1, a2 = x[..., :3], x[..., 3:]
    b1 = torch.nn.functional.normalize(a1, dim=-1)
    b2 = torch.nn.functional.normalize(a2 - (b1 * a2).sum(-1, keepdim=True) * b1, dim=-1)
    return torch.stack([b1, b2, torch.cross(b1, b2, dim=-1)], dim=-2)


class Scene:
    def __init__(self, path, dtype=torch.float32):
        archive = np.load(path)
        get = lambda key: torch.tensor(archive[key], dtype=dtype)
        self.base, self.rotation = get("base"), get("world_rotation")
        self.joints, self.offset = get("joints"), get("skin_offset")
        self.weights, self.dirs = get("weights"), get("finger_dirs")
        self.rest_joints, self.fingers = get("rest_joints"), get("fingers").reshape(15, 3)
        self.object, self.orientation = get("object"), get("orientation")
        self.translation, self.clip_vertices = get("translation"), get("clip_vertices")
        self.lambdas, self.tau = archive["lambdas"].tolist(), float(archive["tau"])
        self.first, self.wrist = int(archive["first_finger_joint"]), int(archive["wrist"])
        self.num_frames = len(self.base) - 1  # to be fitted: 1 .. num_frames

    def vertices(self, frame, local):
        """Hand vertices (N, 3) in the world for finger rotations `local` (15, 3, 3)."""
        first, rest = self.first, self.rest_joints
        turned, moved = [], []
        for k in range(15):
            if k % 3 == 0:
                parent, R, p = self.wrist, self.rotation[frame, self.wrist], self.joints[frame, self.wrist]
            else:
                parent, R, p = first + k - 1, turned[-1], position
            position = p + R @ (rest[first + k] - rest[parent])
            turned.append(R @ local[k])
            moved.append(position - turned[-1] @ rest[first + k])
        rotation = torch.cat([self.rotation[frame, :first], torch.stack(turned), self.rotation[frame, first + 15 :]])
        offset = torch.cat([self.offset[frame, :first], torch.stack(moved), self.offset[frame, first + 15 :]])
        feature = (local - torch.eye(3, dtype=local.dtype)).reshape(135)
        posed = self.base[frame] + (self.dirs @ feature).reshape(-1, 3)
        blend = (self.weights @ rotation.reshape(-1, 9)).reshape(-1, 3, 3)
        return (blend @ posed[:, :, None])[:, :, 0] + self.weights @ offset

    def follow_wrist(self, frame, R, T):
        """The last frame's object carried along rigidly by the wrist."""
        before, now = self.rotation[frame - 1, self.wrist], self.rotation[frame, self.wrist]
        turn = now @ before.T
        return turn @ R, turn @ (T - self.joints[frame - 1, self.wrist]) + self.joints[frame, self.wrist]


class Judge:
    """Energies in double precision, as the paper writes them, for any method's result."""

    def __init__(self, path):
        self.scene = scene = Scene(path, torch.float64)
        start = scene.vertices(0, exp(scene.fingers))
        error = (start - scene.clip_vertices[0]).abs().max().item()
        assert error < 1e-9, f"the scene's hand is not the exported one: {error} m"
        self.rest = torch.cdist(start, scene.object @ scene.orientation.T + scene.translation)
        self.last = (scene.orientation, scene.translation, scene.fingers)

    def energy(self, frame, R, T, fingers):
        """Of frames in order; `fingers` (15, 3) axis-angle."""
        scene = self.scene
        R, T, fingers = (x.detach().double() for x in (R, T, fingers))
        distance = torch.cdist(scene.vertices(frame, exp(fingers)), scene.object @ R.T + T)
        touching = self.rest < scene.tau
        R0, T0, fingers0 = self.last
        cosine = ((R0.T @ R).trace() - 1) / 2
        turn = torch.arccos(cosine.clamp(-1, 1))
        change = turn**2 + ((T - T0) ** 2).sum() + ((fingers - fingers0) ** 2).sum()
        self.last = (R, T, fingers)
        parts = [((distance - self.rest) ** 2).sum(), (distance[touching] ** 2).sum(), change]
        return sum(l * e.item() for l, e in zip(scene.lambdas, parts))


def log(R):
    """Rotation vectors (..., 3) of rotation matrices, for results only."""
    from_matrix = R.detach().double()
    cosine = (from_matrix.diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2
    skew = from_matrix - from_matrix.transpose(-1, -2)
    axis = torch.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], -1) / 2
    sine = axis.norm(dim=-1)
    angle = torch.atan2(sine, cosine)
    return axis * torch.where(sine > 1e-9, angle / sine.clamp_min(1e-12), torch.ones_like(angle))[..., None]


def report(ms, energies, **more):
    json.dump({"ms": ms, "energies": energies, **more}, sys.stdout)
    print()
