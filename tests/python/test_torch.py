# SPDX-License-Identifier: MIT
import sys

import numpy as np
import pytest

import holdfast


def test_without_torch_the_import_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.delitem(sys.modules, "holdfast.torch", raising=False)
    with pytest.raises(ImportError, match="needs PyTorch"):
        import holdfast.torch  # noqa: F401


@pytest.fixture
def learning():
    pytest.importorskip("torch")
    import holdfast.torch

    return holdfast.torch


def tensor(random, *shape):
    import torch

    numbers = 0.05 * random.standard_normal(shape)
    return torch.tensor(numbers, dtype=torch.float64, requires_grad=True)


def test_energies(learning, random):
    import torch

    hand, object = tensor(random, 5, 3), tensor(random, 7, 3)
    reference = np.abs(random.standard_normal((5, 7)))
    check = torch.autograd.gradcheck
    assert check(lambda h, o: learning.distance_energy(h, o, reference), (hand, object))
    assert check(lambda h, o: learning.contact_energy(h, o, reference, 0.5), (hand, object))
    mug = holdfast.SignedDistance("mug")
    assert check(lambda p: learning.penetration_energy(p, mug), (tensor(random, 20, 3),))


def test_body(learning, random):
    import torch

    body = learning.Body(holdfast.BodyModel.load(), vertex_ids=[0, 100, 5000])
    poses, trans = tensor(random, 2, 165), tensor(random, 2, 3)
    vertices, joints = body(poses, trans)
    assert vertices.shape == (2, 3, 3) and joints.shape == (2, 55, 3)
    betas = tensor(random, 4)
    check = torch.autograd.gradcheck
    assert check(lambda t, b: body(poses.detach(), t, b), (trans, betas), atol=1e-6)
    weights = torch.randn(2, 3, 3, dtype=torch.float64)
    (body(poses, trans)[0] * weights).sum().backward()
    step = torch.zeros_like(poses)
    for k in (0, 3 * 21, 164):
        step.zero_()[1, k] = 1e-6
        with torch.no_grad():
            ends = [(body(poses + s * step, trans)[0] * weights).sum() for s in (1, -1)]
        assert poses.grad[1, k].item() == pytest.approx((ends[0] - ends[1]).item() / 2e-6, abs=1e-6)


def test_dtype_is_kept(learning):
    import torch

    body = learning.Body(holdfast.BodyModel.load())
    vertices, _ = body(torch.zeros(1, 55, 3))
    assert vertices.dtype == torch.float32


def test_batches_are_their_items(learning, random):
    import torch

    hand, object = tensor(random, 2, 4, 5, 3), tensor(random, 7, 3)
    reference = np.abs(random.standard_normal((4, 5, 7)))
    energy = learning.distance_energy(hand, object, reference)
    assert energy.shape == (2, 4)
    one = learning.distance_energy(hand[1, 3], object, reference[3])
    assert energy[1, 3].item() == one.item()
    assert torch.autograd.gradcheck(lambda h, o: learning.contact_energy(h, o, reference, 0.5), (hand, object))
    assert learning.penetration_energy(tensor(random, 3, 6, 3), holdfast.SignedDistance("mug")).shape == (3,)

    body = learning.Body(holdfast.BodyModel.load(), vertex_ids=[0, 100, 5000])
    assert isinstance(body, torch.nn.Module) and not list(body.parameters()) and "3 vertices" in repr(body)
    poses, trans, betas = tensor(random, 2, 3, 165), tensor(random, 2, 3, 3), tensor(random, 2, 4)
    vertices, joints = body(poses, trans, betas)
    assert vertices.shape == (2, 3, 3, 3) and joints.shape == (2, 3, 55, 3)
    assert torch.equal(vertices[1], body(poses[1], trans[1], betas[1])[0])
    assert torch.equal(body(poses, trans, betas[0])[0][0], vertices[0])
    assert torch.equal(body(poses[0, 0])[1], body(poses[:1, 0])[1][0])
    assert torch.autograd.gradcheck(lambda t, b: body(poses.detach(), t, b), (trans, betas), atol=1e-6)
    with pytest.raises(ValueError, match="poses: expected"):
        body(torch.zeros(2, 3))
    with pytest.raises(ValueError, match="betas: expected"):
        body(poses, trans, torch.zeros(3, 4, dtype=torch.float64))


def test_rotations_of_other_forms(learning, random):
    import torch

    vectors = 20 * tensor(random, 40, 3).detach()
    x, y, z = vectors.T
    zero = torch.zeros_like(x)
    turns = torch.matrix_exp(torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], 1).reshape(-1, 3, 3))
    six = torch.cat([turns[..., 0], turns[..., 1]], -1)
    back = learning.rotation_vectors(turns)
    x, y, z = back.T
    again = torch.matrix_exp(torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], 1).reshape(-1, 3, 3))
    assert torch.allclose(again, turns, atol=1e-10)
    assert torch.allclose(learning.rotation_vectors(3.0 * six), back, atol=1e-10)
    assert torch.autograd.gradcheck(learning.rotation_vectors, (six[:8].clone().requires_grad_(True),))
    still = torch.eye(3, dtype=torch.float64, requires_grad=True)
    learning.rotation_vectors(still).sum().backward()
    assert torch.isfinite(still.grad).all() and not learning.rotation_vectors(still).any()
    body = learning.Body(holdfast.BodyModel.load(), vertex_ids=[100])
    poses = tensor(random, 2, 55, 3).detach()
    flat = poses.reshape(-1, 3)
    x, y, z = flat.T
    zero = torch.zeros_like(x)
    turns = torch.matrix_exp(torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], 1).reshape(2, 55, 3, 3))
    assert torch.allclose(body(turns)[0], body(poses)[0], atol=1e-10)


def test_change_between_frames(learning, random):
    import torch

    turn, place, fingers = torch.eye(3, dtype=torch.float64).expand(4, 3, 3), tensor(random, 4, 3), tensor(random, 4, 45)
    energy = learning.temporal_energy(turn, place, fingers, turn, place + 0.1, fingers - 0.2)
    assert energy.shape == (4,) and torch.allclose(energy, torch.full((4,), 3 * 0.01 + 45 * 0.04, dtype=torch.float64))
