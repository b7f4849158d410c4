# SPDX-License-Identifier: MIT
"""Poses of a batch with gradients: rotations as six numbers, joints, headings, carried objects.

Meters; columns are turned, x_world = R x. Six numbers are the first two rows of R."""

import torch

PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
LEFT_WRIST, RIGHT_WRIST = 20, 21
FEET = (7, 8, 10, 11)  # ankles, balls


def _levels():
    """Joints by their number of ancestors: [(joints, places of their parents in the level before)]."""
    levels, depth = [([0], None)], {0: 0}
    for joint, parent in enumerate(PARENTS[1:], 1):
        depth[joint] = depth[parent] + 1
        if depth[joint] == len(levels):
            levels.append(([], []))
        levels[depth[joint]][0].append(joint)
        levels[depth[joint]][1].append(levels[depth[parent]][0].index(parent))
    return levels


LEVELS = _levels()
_BACK = [sum((joints for joints, _ in LEVELS), []).index(joint) for joint in range(len(PARENTS))]


def _normalized(v):
    return v / torch.sqrt((v * v).sum(-1, keepdim=True) + 1e-18)


def rotations_of(six):
    """(..., 6) -> (..., 3, 3) by Gram-Schmidt."""
    a1, a2 = six[..., :3], six[..., 3:]
    b1 = _normalized(a1)
    b2 = _normalized(a2 - (b1 * a2).sum(-1, keepdim=True) * b1)
    return torch.stack((b1, b2, torch.cross(b1, b2, dim=-1)), -2)


def six_of(rotations):
    return rotations[..., :2, :].flatten(-2)


def turned(rotations, v):
    """R v, (..., 3, 3) and (..., 3)."""
    return (rotations * v.unsqueeze(-2)).sum(-1)


def exponential(axis_angle):
    """Rodrigues' rotation (..., 3, 3) of axis-angles (..., 3), radians."""
    angle = torch.sqrt((axis_angle * axis_angle).sum(-1, keepdim=True) + 1e-12)
    x, y, z = (axis_angle / angle).unbind(-1)
    o = torch.zeros_like(x)
    cross = torch.stack((o, -z, y, z, o, -x, -y, x, o), -1).unflatten(-1, (3, 3))
    a = angle.unsqueeze(-1)
    return torch.eye(3).to(a) + torch.sin(a) * cross + (1.0 - torch.cos(a)) * (cross @ cross)


def forward_joints(rotations, transl, bones):
    """Joints (N, 22, 3) and the wrists' world rotations (N, 2, 3, 3), left and right.

    rotations (N, 22, 3, 3) relative to parents, transl (N, 3), bones (N or 1, 22, 3): the rest
    offset of each joint from its parent, the pelvis' from the origin."""
    world, joints = [rotations[:, :1]], [transl.unsqueeze(1) + bones[:, :1]]
    for below, parents in LEVELS[1:]:
        above = world[-1][:, parents]
        joints.append(joints[-1][:, parents] + turned(above, bones[:, below]))
        world.append(above @ rotations[:, below])
    return torch.cat(joints, 1)[:, _BACK], world[-1]


def wrist_position(rotations, transl, bones, wrist):
    """A wrist alone (N, 3), by the joints that move it."""
    joint, point = PARENTS[wrist], bones[:, wrist].expand_as(transl)
    while joint > 0:
        point = bones[:, joint] + turned(rotations[:, joint], point)
        joint = PARENTS[joint]
    return transl + bones[:, 0] + turned(rotations[:, 0], point)


def heading_of(root):
    """Cosine and sine (N, 1) of the azimuth of a body with this root rotation."""
    x, y = root[:, 0, :1], root[:, 1, :1]
    inverse = 1.0 / torch.sqrt((x * x + y * y).clamp_min(1e-12))
    return x * inverse, y * inverse


def to_heading(heading, v):
    """Z^T v."""
    c, s = heading
    return torch.cat((c * v[:, :1] + s * v[:, 1:2], c * v[:, 1:2] - s * v[:, :1], v[:, 2:]), 1)


def to_world(heading, v):
    """Z v."""
    c, s = heading
    return torch.cat((c * v[:, :1] - s * v[:, 1:2], s * v[:, :1] + c * v[:, 1:2], v[:, 2:]), 1)


def carried(object_T, object_R, before, after, left, right):
    """The object carried rigidly between two bodies (forward_joints) by the left wrist where left
    (N,) is 1, by the right where right is 1; it stays where both are 0."""
    T, R = (1.0 - left - right).view(-1, 1) * object_T, (1.0 - left - right).view(-1, 1, 1) * object_R
    for by, k, joint in ((left, 0, LEFT_WRIST), (right, 1, RIGHT_WRIST)):
        turn = after[1][:, k] @ before[1][:, k].transpose(1, 2)
        moved = turned(turn, object_T - before[0][:, joint]) + after[0][:, joint]
        T, R = T + by.view(-1, 1) * moved, R + by.view(-1, 1, 1) * (turn @ object_R)
    return T, R
