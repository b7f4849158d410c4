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
