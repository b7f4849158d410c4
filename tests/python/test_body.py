# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import holdfast
from support import refused

IDS = np.arange(5, 2000, 37)


@pytest.fixture(scope="module")
def model():
    return holdfast.BodyModel.load()


@pytest.fixture(scope="module")
def motion():
    clip = holdfast.Clip.load("demo_drink")
    return np.array(clip.poses[:5]), np.array(clip.trans[:5]), np.linspace(-1, 1, 5)


def test_what_the_model_is(model):
    assert model.num_vertices > IDS.max() and model.num_shape > 0
    faces = model.faces
    assert faces.shape[1] == 3 and faces.min() == 0 and faces.max() < model.num_vertices
    assert len(model.joint_names) == 55 and model.joint_names == holdfast.JOINT_NAMES
    assert model.joint_names[0] == "pelvis" and model.joint_names[21] == "right_wrist"
    assert model.joint_parents[0] == -1
    assert all(parent < joint for joint, parent in enumerate(model.joint_parents))
    assert model.name
    right = model.hand_vertex_ids("right")
    assert len(right) > 100 and right.max() < model.num_vertices
    refused(ValueError, "'right', 'left'", model.hand_vertex_ids, "third")


def test_shapes_and_that_all_ways_to_ask_agree(model, motion):
    poses, trans, betas = motion
    vertices, joints = model(poses, trans, betas)
    assert vertices.shape == (5, model.num_vertices, 3) and vertices.dtype == np.float64
    assert joints.shape == (5, 55, 3)
    some, same = model(poses.reshape(5, 55, 3), trans, betas, vertex_ids=IDS, threads=2)
    assert np.array_equal(some, vertices[:, IDS]) and np.array_equal(same, joints)
    # The same model with other betas, then with these again.
    other, _ = model(poses, trans, vertex_ids=IDS)
    again, _ = model(poses, trans, betas, vertex_ids=IDS, threads=1)
    assert np.array_equal(some, again) and not np.allclose(some, other)
    assert np.array_equal(other, model(poses, trans, 0.0 * betas, IDS)[0])
    none, joints_only = model(poses, trans, betas, vertex_ids=np.zeros(0, int))
    assert none.shape == (5, 0, 3) and np.array_equal(joints_only, joints)
    here, _ = model(poses, betas=betas, vertex_ids=IDS)
    assert np.allclose(here + trans[:, None], some, atol=1e-12)
    for array in model(np.zeros((0, 165))):
        assert len(array) == 0


def test_many_frames_do_not_depend_on_threads(model, motion):
    poses = np.tile(motion[0], (30, 1))
    one = model(poses, vertex_ids=IDS, threads=1)
    four = model(poses, vertex_ids=IDS, threads=4)
    assert all(np.array_equal(a, b) for a, b in zip(one, four))
    assert np.array_equal(one[0][:5], one[0][-5:])


def test_the_pelvis_is_where_trans_says(model):
    _, rest = model(np.zeros((1, 165)))
    poses = np.zeros((1, 165))
    poses[0, :3] = [0.3, -0.2, 1.0]
    _, joints = model(poses, [[1.0, 2.0, 3.0]])
    assert np.allclose(joints[0, 0], rest[0, 0] + [1, 2, 3])


def test_vjp_is_the_gradient(model, motion):
    poses, trans, betas = motion[0][:3], motion[1][:3], motion[2]
    rng = np.random.default_rng(1)
    by_vertices = rng.normal(size=(3, len(IDS), 3))
    by_joints = rng.normal(size=(3, 55, 3))

    def loss(poses, trans, betas):
        vertices, joints = model(poses, trans, betas, IDS)
        return (by_vertices * vertices).sum() + (by_joints * joints).sum()

    grad_poses, grad_trans, grad_betas = model.vjp(
        poses, trans, betas, by_vertices, by_joints, IDS, with_betas=True)
    assert grad_poses.shape == (3, 165) and grad_trans.shape == (3, 3)
    assert grad_betas.shape == betas.shape
    step = 1e-5
    largest = np.abs(grad_poses).max()
    for frame, column in [(0, 0), (0, 10), (1, 58), (1, 62), (2, 90), (2, 130), (2, 164)]:
        moved = np.zeros_like(poses)
        moved[frame, column] = step
        difference = (loss(poses + moved, trans, betas) - loss(poses - moved, trans, betas))
        assert grad_poses[frame, column] == pytest.approx(
            difference / (2 * step), rel=1e-6, abs=1e-6 * largest)
    assert np.allclose(grad_trans, by_vertices.sum(1) + by_joints.sum(1))
    for k in range(len(betas)):
        moved = np.zeros_like(betas)
        moved[k] = 1e-3
        difference = loss(poses, trans, betas + moved) - loss(poses, trans, betas - moved)
        assert grad_betas[k] == pytest.approx(
            difference / 2e-3, rel=1e-6, abs=1e-6 * np.abs(grad_betas).max())


def test_vjp_of_parts_adds_up_and_does_not_depend_on_threads(model, motion):
    poses, trans, betas = motion
    poses, trans = np.tile(poses, (20, 1)), np.tile(trans, (20, 1))
    rng = np.random.default_rng(2)
    by_vertices = rng.normal(size=(100, len(IDS), 3))
    by_joints = rng.normal(size=(100, 55, 3))
    both = model.vjp(poses, trans, betas, by_vertices, by_joints, IDS, 1, with_betas=True)
    threaded = model.vjp(poses, trans, betas, by_vertices, by_joints, IDS, 4, with_betas=True)
    assert all(np.array_equal(a, b) for a, b in zip(both, threaded))
    first = model.vjp(poses, trans, betas, grad_vertices=by_vertices, vertex_ids=IDS)
    second = model.vjp(poses, trans, betas, grad_joints=by_joints, vertex_ids=IDS)
    assert len(first) == 2
    for whole, a, b in zip(both, first, second):
        assert np.allclose(whole, a + b, atol=1e-9)
    empty = model.vjp(np.zeros((0, 165)), None, betas, grad_joints=np.zeros((0, 55, 3)),
                      with_betas=True)
    assert empty[0].shape == (0, 165) and not empty[2].any()


@pytest.mark.parametrize("error, arguments, message", [
    (ValueError, dict(poses=np.zeros((2, 156))), r"poses: expected numbers of shape \(n, 165\)"),
    (ValueError, dict(poses=np.zeros(165)), "poses"),
    (ValueError, dict(poses=np.full((2, 165), np.nan)), r"poses\[0, 0\] is NaN"),
    (TypeError, dict(poses="standing"), "poses"),
    (TypeError, dict(poses=None), "poses"),
    (ValueError, dict(trans=np.zeros((3, 3))), "trans"),
    (ValueError, dict(trans=np.full((2, 3), np.inf)), "trans"),
    (ValueError, dict(betas=np.zeros((1, 10))), "betas"),
    (holdfast.Error, dict(betas=np.ones(5000)), "shape coefficients"),
    (holdfast.Error, dict(vertex_ids=[0, 10**6]), "has no vertex 1000000"),
    (holdfast.Error, dict(vertex_ids=[-1]), "has no vertex -1"),
    (TypeError, dict(vertex_ids=[0.5]), "vertex_ids"),
    (ValueError, dict(threads=-1), "threads"),
])
def test_bad_input(model, error, arguments, message):
    arguments = {"poses": np.zeros((2, 165)), "trans": None, "betas": None, **arguments}
    refused(error, message, model, **arguments)
    refused(error, message, model.vjp, **arguments, grad_joints=np.zeros((2, 55, 3)))


def test_bad_gradients(model):
    poses = np.zeros((2, 165))
    refused(ValueError, "None for both", model.vjp, poses, None, None)
    with pytest.raises(ValueError, match="grad_vertices: expected"):
        model.vjp(poses, None, None, grad_vertices=np.zeros((2, 4, 3)), vertex_ids=[1, 2, 3])
    with pytest.raises(ValueError, match="grad_joints: expected"):
        model.vjp(poses, None, None, grad_joints=np.zeros((1, 55, 3)))
    refused(ValueError, "grad_joints", model.vjp, poses, None, None, grad_joints=np.full((2, 55, 3), np.nan))


def test_bad_files(tmp_path):
    refused(holdfast.Error, "missing.npz", holdfast.BodyModel.load, tmp_path / "missing.npz")
    np.savez(tmp_path / "no_model.npz", v_template=np.zeros((4, 3)))
    refused(holdfast.Error, "no_model.npz", holdfast.BodyModel.load, tmp_path / "no_model.npz")
    refused(TypeError, "", holdfast.BodyModel.load, 3)
    refused(TypeError, "", holdfast.BodyModel)
