# SPDX-License-Identifier: MIT
"""The body model and the energy terms as differentiable PyTorch functions.

>>> import holdfast, holdfast.torch
>>> body = holdfast.torch.Body(holdfast.BodyModel.load())
>>> vertices, joints = body(poses, trans)
>>> loss = holdfast.torch.distance_energy(vertices, object_vertices, reference).sum()
>>> loss.backward()

Leading dimensions are batches: "(..., N, 3)" is (N, 3), (T, N, 3) or (B, T, N, 3). Holdfast computes
on the CPU in float64, frames in parallel; results have the dtype and the device of the first
argument, so tensors on a GPU are copied to the CPU and back. Gradients are analytic and cannot be
differentiated again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional, Sequence, Union

import numpy as np
from numpy.typing import NDArray

try:
    import torch
    from torch import Tensor
    from torch.autograd.function import once_differentiable
except ImportError as error:
    raise ImportError(
        "holdfast.torch needs PyTorch: install the package python3-torch, or 'pip install torch'"
    ) from error

from . import _core

_Points = Union[Tensor, NDArray[np.float64]]

__all__ = ["Body", "contact_energy", "distance_energy", "penetration_energy", "rotation_vectors", "temporal_energy"]


def _numpy(tensor):
    return torch.as_tensor(tensor).detach().to("cpu", torch.float64).numpy()


def _like(array, tensor):
    return torch.as_tensor(array).to(device=tensor.device, dtype=tensor.dtype)


class _Energy(torch.autograd.Function):
    """energy(*points) by a function that returns (energy, gradient, ...)."""

    @staticmethod
    def forward(ctx, energy, *points):
        value, *gradients = energy(*map(_numpy, points))
        ctx.save_for_backward(*(_like(g, p) for g, p in zip(gradients, points)))
        return torch.as_tensor(value, dtype=points[0].dtype, device=points[0].device)

    @staticmethod
    @once_differentiable
    def backward(ctx, grad):
        pairs = zip(ctx.saved_tensors, ctx.needs_input_grad[1:])
        return None, *(grad.to(g.device, g.dtype) * g if needed else None for g, needed in pairs)


def _batched(energy, points, constants=()):
    """energy(*points, *constants) of every item of a batch. points: tensors (..., N, 3); constants:
    arrays (..., N, M) without gradient. Those with fewer dimensions serve all items."""
    points = [torch.as_tensor(point) for point in points]
    constants = [torch.as_tensor(constant) for constant in constants]
    shape = torch.broadcast_shapes(*(value.shape[:-2] for value in points + constants))
    flat = [value.expand(*shape, *value.shape[-2:]).reshape(-1, *value.shape[-2:]) for value in points + constants]
    count = len(points)
    values = [_Energy.apply(lambda *p, rest=item[count:]: energy(*p, *map(_numpy, rest)), *item[:count])
              for item in zip(*flat)]
    return torch.stack(values).reshape(shape) if values else points[0].new_zeros(shape)


def distance_energy(hand: Tensor, object: _Points, reference: _Points) -> Tensor:
    """E_d = sum_ij (|h_i - o_j| - D_ij)^2 (IMoS, eq. 7).

    Parameters
    ----------
    hand : Tensor (..., N, 3)
    object : Tensor or array (..., M, 3)
        Meters. Both are differentiated.
    reference : Tensor or array (..., N, M)
        D, meters.

    Returns
    -------
    Tensor (...)
        Square meters.
    """
    return _batched(_core.distance_energy, (hand, object), (reference,))


def contact_energy(hand: Tensor, object: _Points, reference: _Points, threshold_m: float = 0.01) -> Tensor:
    """E_c = sum |h_i - o_j|^2 over the pairs with D_ij < threshold_m (IMoS, eq. 8).

    Parameters
    ----------
    hand : Tensor (..., N, 3)
    object : Tensor or array (..., M, 3)
        Meters. Both are differentiated.
    reference : Tensor or array (..., N, M)
        D, meters.
    threshold_m : float, default 0.01

    Returns
    -------
    Tensor (...)
        Square meters.
    """
    return _batched(lambda h, o, d: _core.contact_energy(h, o, d, threshold_m), (hand, object), (reference,))


def penetration_energy(points: Tensor, signed_distance: _core.SignedDistance, give_m: float = 0.0) -> Tensor:
    """sum_i max(0, -d(p_i) - give_m)^2 of points in a surface.

    Parameters
    ----------
    points : Tensor (..., N, 3)
        In the frame of the surface, meters. Differentiated.
    signed_distance : holdfast.SignedDistance
        d, negative inside.
    give_m : float, default 0.0
        Depths up to this are free, meters.

    Returns
    -------
    Tensor (...)
        Square meters.
    """
    return _batched(lambda p: _core.penetration_energy(p, signed_distance, give_m), (points,))


def temporal_energy(rotation: Tensor, translation: Tensor, fingers: Tensor, rotation_before: Tensor,
                    translation_before: Tensor, fingers_before: Tensor) -> Tensor:
    """E_t = |log(R_before^T R)|^2 + |T - T_before|^2 + |P - P_before|^2 (IMoS, eq. 9).

    All arguments are differentiated, by PyTorch.

    Parameters
    ----------
    rotation : Tensor (..., 3, 3)
        R.
    translation : Tensor (..., 3)
        T, meters.
    fingers : Tensor (..., 45)
        P, axis-angle in radians.
    rotation_before : Tensor (..., 3, 3)
    translation_before : Tensor (..., 3)
    fingers_before : Tensor (..., 45)
        The same of the frame before.

    Returns
    -------
    Tensor (...)
    """
    turned = rotation_vectors(rotation_before.transpose(-1, -2) @ rotation)
    return sum((change ** 2).sum(-1) for change in (turned, translation - translation_before, fingers - fingers_before))


def rotation_vectors(rotations: Tensor) -> Tensor:
    """Converts rotation matrices or 6D rotations to axis-angle.

    Matrices are taken as they are; 6D are orthogonalized. Differentiable, except at half turns.

    Parameters
    ----------
    rotations : Tensor (..., 3, 3) or (..., 6)
        Matrices, or the 6D representation: the first two columns of the matrix, one after the other
        (Zhou et al. 2019).

    Returns
    -------
    Tensor (..., 3)
        Radians.
    """
    if rotations.shape[-1] == 6:
        first = torch.nn.functional.normalize(rotations[..., :3], dim=-1)
        second = rotations[..., 3:] - (first * rotations[..., 3:]).sum(-1, keepdim=True) * first
        second = torch.nn.functional.normalize(second, dim=-1)
        columns = (first, second, torch.linalg.cross(first, second))
        rotations = torch.stack(columns, -1)
    m = rotations
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    # 4 q q^T: the column with the largest diagonal entry is accurate.
    w, x, y, z = 1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz
    wx, wy, wz = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    xy, xz, yz = m[..., 0, 1] + m[..., 1, 0], m[..., 0, 2] + m[..., 2, 0], m[..., 1, 2] + m[..., 2, 1]
    all_columns = torch.stack([torch.stack(column, -1) for column in (
        (w, wx, wy, wz), (wx, x, xy, xz), (wy, xy, y, yz), (wz, xz, yz, z))], -2)
    best = torch.stack((w, x, y, z), -1).argmax(-1)[..., None, None].expand(*m.shape[:-2], 1, 4)
    quaternion = torch.nn.functional.normalize(all_columns.gather(-2, best)[..., 0, :], dim=-1)
    quaternion = torch.where(quaternion[..., :1] < 0, -quaternion, quaternion)
    w, axis = quaternion[..., :1], quaternion[..., 1:]
    square = (axis ** 2).sum(-1, keepdim=True)
    small = square < 1e-20  # the derivative of a length at zero is not a number
    sine = torch.where(small, torch.ones_like(square), square).sqrt()
    return axis * torch.where(small, 2 / w, 2 * torch.atan2(sine, w) / sine)


class _Vertices(torch.autograd.Function):
    @staticmethod
    def forward(ctx, body, poses, trans, betas):
        ctx.body = body
        ctx.save_for_backward(poses, trans, betas)
        vertices, joints = body.model(*map(_numpy, (poses, trans, betas)), body.vertex_ids, threads=body.threads)
        return _like(vertices, poses), _like(joints, poses)

    @staticmethod
    @once_differentiable
    def backward(ctx, grad_vertices, grad_joints):
        inputs = ctx.saved_tensors
        gradients = ctx.body.model.vjp(
            *map(_numpy, (*inputs, grad_vertices, grad_joints)),
            ctx.body.vertex_ids,
            threads=ctx.body.threads,
            with_betas=ctx.needs_input_grad[3],
        )
        by_inputs = [_like(g, x).reshape(x.shape) for g, x in zip(gradients, inputs)]
        return None, *by_inputs, *([None] * (3 - len(by_inputs)))


class Body(torch.nn.Module):
    """A body model as a module without parameters.

    Parameters
    ----------
    model : holdfast.BodyModel
    vertex_ids : array_like (V,) of int, optional
        The vertices to compute. Default: all.
    threads : int, default 0
        0: all.
    """

    def __init__(self, model: _core.BodyModel, vertex_ids: Union[Sequence[int], NDArray[np.int32], None] = None,
                 threads: int = 0) -> None:
        super().__init__()
        self.model = model
        self.vertex_ids = vertex_ids
        self.threads = threads

    def forward(self, poses: Tensor, trans: Optional[Tensor] = None, betas: Optional[Tensor] = None) -> tuple[Tensor, Tensor]:
        """Poses the body.

        All arguments are differentiated.

        Parameters
        ----------
        poses : Tensor (..., 165), (..., 55, 3), (..., 55, 3, 3) or (..., 55, 6)
            Axis-angle in radians, matrices, or 6D as in rotation_vectors().
        trans : Tensor (..., 3), optional
            Meters. Default: zero.
        betas : Tensor (K,) or (B, K), optional
            Shape coefficients of all, or of each item of the first dimension of (B, T, ...).
            Default: zero.

        Returns
        -------
        vertices : Tensor (..., V, 3)
            Meters, in the frame of trans.
        joints : Tensor (..., 55, 3)
            The same.
        """
        if poses.shape[-2:] == (3, 3) and poses.dim() > 3 or poses.shape[-2:] == (55, 6):
            poses = rotation_vectors(poses)
        if poses.shape[-2:] == (55, 3):
            poses = poses.flatten(-2)
        if poses.shape[-1:] != (165,):
            raise ValueError(f"poses: expected (..., 165), (..., 55, 3), (..., 55, 3, 3) or (..., 55, 6), got {tuple(poses.shape)}")
        batch = poses.shape[:-1]
        trans = poses.new_zeros(*batch, 3) if trans is None else trans.expand(*batch, 3)
        betas = poses.new_zeros(0) if betas is None else betas
        if betas.dim() < 2:
            vertices, joints = _Vertices.apply(self, poses.reshape(-1, 165), trans.reshape(-1, 3), betas)
            return vertices.reshape(*batch, -1, 3), joints.reshape(*batch, 55, 3)
        if betas.dim() > 2 or not batch or len(betas) not in (1, batch[0]):
            raise ValueError(f"betas: expected (K,), or one row for each of {batch[0] if batch else 1}, got {tuple(betas.shape)}")
        betas = betas.expand(batch[0], -1)
        shown = [self.forward(pose, place, shape) for pose, place, shape in zip(poses, trans, betas)]
        vertices, joints = zip(*shown)
        return torch.stack(vertices), torch.stack(joints)

    if TYPE_CHECKING:  # for checkers: what Module.__call__ forwards

        def __call__(self, poses: Tensor, trans: Optional[Tensor] = None,
                     betas: Optional[Tensor] = None) -> tuple[Tensor, Tensor]: ...

    def extra_repr(self) -> str:
        count = self.model.num_vertices if self.vertex_ids is None else len(self.vertex_ids)
        return f"{self.model.name}, {count} vertices"
