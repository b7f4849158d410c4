# SPDX-License-Identifier: MIT
"""The body model and the energy terms as differentiable PyTorch functions.

>>> import holdfast, holdfast.torch
>>> body = holdfast.torch.Body(holdfast.BodyModel.load())
>>> vertices, joints = body(poses, trans)
>>> loss = holdfast.torch.distance_energy(vertices[0], object_vertices, reference)
>>> loss.backward()

Holdfast computes on the CPU in float64; results have the dtype and the device of the first
argument. Gradients are analytic and cannot be differentiated again.
"""

try:
    import torch
    from torch.autograd.function import once_differentiable
except ImportError as error:
    raise ImportError(
        "holdfast.torch needs PyTorch: install the package python3-torch, or 'pip install torch'"
    ) from error

from . import _core

__all__ = ["Body", "contact_energy", "distance_energy", "penetration_energy"]


def _numpy(tensor):
    return torch.as_tensor(tensor).detach().to("cpu", torch.float64).numpy()


def _like(array, tensor):
    return torch.as_tensor(array).to(device=tensor.device, dtype=tensor.dtype)


class _Energy(torch.autograd.Function):
    """energy(*points) by a function that returns (energy, gradient, ...)."""

    @staticmethod
    def forward(ctx, energy, *points):
        value, *gradients = energy(*map(_numpy, points))
        points = [torch.as_tensor(point) for point in points]  # arrays may be among them
        ctx.save_for_backward(*(_like(g, p) for g, p in zip(gradients, points)))
        return torch.as_tensor(value, dtype=points[0].dtype, device=points[0].device)

    @staticmethod
    @once_differentiable
    def backward(ctx, grad):
        pairs = zip(ctx.saved_tensors, ctx.needs_input_grad[1:])
        return None, *(grad.to(g.device, g.dtype) * g if needed else None for g, needed in pairs)


def distance_energy(hand, object, reference):
    """E_d = sum_ij (|h_i - o_j| - D_ij)^2 as a tensor: hand (N, 3), object (M, 3), D (N, M)."""
    reference = _numpy(reference)
    return _Energy.apply(lambda h, o: _core.distance_energy(h, o, reference), hand, object)


def contact_energy(hand, object, reference, threshold_m=0.01):
    """E_c = sum |h_i - o_j|^2 over the pairs with D_ij < threshold_m, as a tensor."""
    reference = _numpy(reference)
    return _Energy.apply(
        lambda h, o: _core.contact_energy(h, o, reference, threshold_m), hand, object
    )


def penetration_energy(points, signed_distance, give_m=0.0):
    """sum_i max(0, -d(p_i) - give_m)^2 as a tensor: points (N, 3) in the frame of the surface."""
    return _Energy.apply(
        lambda p: _core.penetration_energy(p, signed_distance, give_m), points
    )


class _Vertices(torch.autograd.Function):
    @staticmethod
    def forward(ctx, body, poses, trans, betas):
        ctx.body = body
        ctx.save_for_backward(poses, trans, betas)
        vertices, joints = body.model(
            *map(_numpy, (poses, trans, betas)), body.vertex_ids, threads=body.threads
        )
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


class Body:
    """A body model: body(poses, trans, betas) -> (vertices (T, V, 3), joints (T, 55, 3)), meters.

    model: a holdfast.BodyModel. vertex_ids: the vertices to compute, all when None. poses (T, 165)
    or (T, 55, 3), trans (T, 3), betas (B,), zero when None; all three are differentiated.
    """

    def __init__(self, model, vertex_ids=None, threads=0):
        self.model = model
        self.vertex_ids = vertex_ids
        self.threads = threads

    def __call__(self, poses, trans=None, betas=None):
        if trans is None:
            trans = poses.new_zeros(poses.shape[0], 3)
        if betas is None:
            betas = poses.new_zeros(0)
        return _Vertices.apply(self, poses, trans, betas)
