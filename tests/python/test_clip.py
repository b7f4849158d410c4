# SPDX-License-Identifier: MIT
import gc
import logging
from pathlib import Path

import numpy as np
import pytest

import holdfast
from support import refused


def test_a_clip_of_arrays(random):
    poses, trans = random.standard_normal((5, 165)), random.standard_normal((5, 3))
    clip = holdfast.Clip(poses, trans, frame_rate=60.0, betas=[0.5, -0.5], gender="female")
    assert len(clip) == 5 and clip.frame_rate == 60.0 and clip.gender == "female"
    np.testing.assert_array_equal(clip.poses, poses)
    np.testing.assert_array_equal(clip.trans, trans)
    np.testing.assert_array_equal(clip.betas, [0.5, -0.5])
    assert "5 frames at 60 Hz" in repr(clip)
    by_joint = holdfast.Clip(poses.reshape(5, 55, 3), trans)
    np.testing.assert_array_equal(by_joint.poses, poses)


def test_arrays_are_views():
    clip = holdfast.Clip(np.zeros((3, 165)), np.zeros((3, 3)))
    clip.poses[1, 3] = 0.25
    assert clip.pose_body[1, 0] == 0.25
    clip.pose_hand[2, 89] = 0.5
    assert clip.poses[2, 164] == 0.5
    clip.trans[0] = 1, 2, 3
    np.testing.assert_array_equal(clip.trans[0], [1, 2, 3])
    shapes = {"root_orient": 3, "pose_body": 63, "pose_jaw": 3, "pose_eye": 6, "pose_hand": 90}
    for name, width in shapes.items():
        assert getattr(clip, name).shape == (3, width)


def test_a_view_outlives_its_clip():
    clip = holdfast.Clip(np.full((3, 165), 0.5), np.zeros((3, 3)))
    poses = clip.poses
    del clip
    gc.collect()
    assert (poses == 0.5).all()


def test_wrong_arrays_are_said():
    poses, trans = np.zeros((4, 165)), np.zeros((4, 3))
    with pytest.raises(ValueError, match=r"poses: expected .* \(n, 165\), got \(4, 164\)"):
        holdfast.Clip(poses[:, :164], trans)
    refused(ValueError, r"trans: expected .* \(4, 3\), got \(3, 3\)", holdfast.Clip, poses, trans[:3])
    refused(ValueError, "NaN", holdfast.Clip, np.full((4, 165), np.nan), trans)
    refused(ValueError, "one frame or more", holdfast.Clip, poses[:0], trans[:0])
    refused(TypeError, "poses", holdfast.Clip, None, trans)
    refused(TypeError, "dtype", holdfast.Clip, poses + 1j, trans)
    refused(ValueError, "frame_rate", holdfast.Clip, poses, trans, frame_rate=0.0)
    refused(ValueError, "holding_hand", holdfast.Clip, poses, trans, holding_hand=[1, 2])
    refused(ValueError, "4: expected 0 nobody", holdfast.Clip, poses, trans, holding_hand=[1, 2, 3, 4])


def test_object_track():
    track = holdfast.ObjectTrack(np.ones((4, 3)), np.zeros((4, 3)), name="mug")
    clip = holdfast.Clip(np.zeros((4, 165)), np.zeros((4, 3)), object=track)
    assert len(clip.object) == 4 and clip.object.name == "mug"
    clip.object.trans[2, 1] = 7.0
    assert clip.object.trans[2, 1] == 7.0 and track.trans[2, 1] == 1.0
    with pytest.raises(ValueError, match="object: expected 3 rows"):
        clip[:3].with_object(track)
    with pytest.raises(ValueError, match="object: expected 3 rows"):
        holdfast.Clip(np.zeros((3, 165)), np.zeros((3, 3)), object=track)
    assert clip.with_object(None).object is None and clip.object is not None
    with pytest.raises(AttributeError):
        clip.object = None  # views of it would dangle
    assert clip.with_object(None).with_object(track).object.trans[2, 1] == 1.0


@pytest.mark.parametrize("rate", [0.0, -30.0, float("nan"), float("inf")])
def test_frame_rate_is_positive(rate):
    clip = holdfast.Clip(np.zeros((2, 165)), np.zeros((2, 3)))
    with pytest.raises(ValueError, match="frame_rate"):
        clip.frame_rate = rate


def test_slices_and_other_frame_rates(demo):
    clip = holdfast.Clip.load("demo_drink")
    part = clip[2:10]
    assert len(part) == 8
    np.testing.assert_array_equal(part.poses, clip.poses[2:10])
    assert len(clip[-3:]) == 3
    for bad in (slice(0, 8, 2), slice(5, 5)):
        with pytest.raises(ValueError):
            clip[bad]
    half = clip.resample(clip.frame_rate / 2)
    assert abs(len(half) - len(clip) / 2) <= 1
    refused(ValueError, "", clip.resample, -1.0)


def test_copy_is_deep(demo):
    copy = demo.copy()
    copy.trans[:] += 1.0
    assert not np.array_equal(copy.trans, demo.trans)


def test_saved_and_loaded(demo, tmp_path):
    path = tmp_path / "clip.npz"
    demo.save(path)
    again = holdfast.Clip.load(str(path))
    np.testing.assert_array_equal(again.poses, demo.poses)
    np.testing.assert_array_equal(again.trans, demo.trans)
    assert again.frame_rate == demo.frame_rate
    with np.load(path) as archive:  # AMASS's layout
        assert archive["poses"].shape == (8, 165)


def test_what_cannot_be_loaded_is_said(tmp_path):
    refused(holdfast.Error, "no_such_clip", holdfast.Clip.load, "no_such_clip")
    empty = tmp_path / "empty.npz"
    empty.write_bytes(b"")
    refused(ValueError, "empty.npz", holdfast.Clip.load, str(empty))


def test_smplx_arguments(demo):
    arguments = demo.to_smplx()
    widths = {"global_orient": 3, "body_pose": 63, "jaw_pose": 3, "leye_pose": 3, "reye_pose": 3}
    widths |= {"left_hand_pose": 45, "right_hand_pose": 45, "transl": 3}
    assert set(arguments) == set(widths) | {"betas"}
    for name, width in widths.items():
        assert arguments[name].shape == (8, width)
    assert arguments["betas"].shape[0] == 1
    np.testing.assert_array_equal(arguments["right_hand_pose"], demo.poses[:, 120:165])


class Smplx:
    """The checks of shape that smplx's SMPLX.forward() makes of its arguments, and its full pose: for a
    model created with use_pca=False, flat_hand_mean=True, and these batch_size and num_betas."""

    def __init__(self, batch_size, num_betas, expressions=10):
        self.expression = np.zeros((batch_size, expressions))
        self.landmarks = np.zeros((batch_size, 51, 3))
        self.num_betas = num_betas

    def forward(self, betas=None, global_orient=None, body_pose=None, left_hand_pose=None, right_hand_pose=None,
                transl=None, expression=None, jaw_pose=None, leye_pose=None, reye_pose=None):
        expression = self.expression if expression is None else expression
        hands = [np.einsum("bi,ij->bj", pose, np.eye(45)) for pose in (left_hand_pose, right_hand_pose)]
        pose = np.concatenate([global_orient, body_pose, jaw_pose, leye_pose, reye_pose, *hands], axis=1)
        batch = max(len(betas), len(global_orient), len(body_pose))
        betas = np.broadcast_to(betas, (batch // len(betas) * len(betas), betas.shape[1]))
        shape = np.concatenate([betas, expression], axis=-1)
        assert shape.shape == (batch, self.num_betas + expression.shape[1]) and len(self.landmarks) == batch
        return pose, betas, transl


def test_arguments_run_in_smplx_and_come_back(demo):
    clip = demo.copy()
    clip.betas = np.linspace(-1, 1, 12)
    arguments = clip.to_smplx()
    pose, betas, transl = Smplx(batch_size=len(clip), num_betas=clip.betas.size).forward(**arguments)
    np.testing.assert_array_equal(pose, clip.poses)
    np.testing.assert_array_equal(betas[3], clip.betas)
    np.testing.assert_array_equal(transl, clip.trans)
    again = holdfast.Clip.from_smplx(arguments, clip.frame_rate)
    for name in ("poses", "trans", "betas", "frame_rate"):
        np.testing.assert_array_equal(getattr(again, name), getattr(clip, name))
    bare = holdfast.Clip.from_smplx({"global_orient": arguments["global_orient"], "body_pose": clip.pose_body.reshape(-1, 21, 3)})
    assert not bare.trans.any() and not bare.pose_hand.any() and bare.betas.size == 0
    np.testing.assert_array_equal(bare.pose_body, clip.pose_body)
    refused(ValueError, "principal components need import_motion", holdfast.Clip.from_smplx,
            arguments | {"left_hand_pose": np.zeros((len(clip), 12))})
    refused(TypeError, "'body_pos'. Did you mean 'body_pose'", holdfast.Clip.from_smplx, {"body_pos": clip.pose_body})
    refused(ValueError, "expected 8 rows", holdfast.Clip.from_smplx, arguments | {"jaw_pose": np.zeros((3, 3))})
    as_lists = holdfast.import_motion({name: value.tolist() for name, value in arguments.items()}, up="z", keep_ground=True)
    np.testing.assert_allclose(as_lists.trans, clip.trans, atol=1e-12)
    refused(TypeError, "a path or a dict", holdfast.import_motion, 5)
    refused(holdfast.Error, "without a known motion", holdfast.import_motion, {"numbers": np.zeros(3)})


def matrices(poses):
    """Rotation matrices (T, 55, 3, 3) of axis-angle (T, 165)."""
    vectors = poses.reshape(len(poses), 55, 3)
    angle = np.maximum(np.linalg.norm(vectors, axis=-1)[..., None, None], 1e-12)
    x, y, z = np.moveaxis(vectors / angle[..., 0], -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*x.shape, 3, 3)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def test_matrices_and_6d_are_poses(demo):
    turned = matrices(demo.poses)
    six = np.concatenate([turned[..., 0], turned[..., 1]], axis=-1)
    for poses in (turned, six, 2.0 * six):
        np.testing.assert_allclose(holdfast.Clip(poses, demo.trans).poses, demo.poses, atol=1e-9)
    refused(ValueError, r"poses\[0, 0\] is not a rotation", holdfast.Clip, 1.1 * turned, demo.trans)
    refused(ValueError, "not a rotation", holdfast.Clip, 0.0 * six, demo.trans)
    refused(ValueError, "expected", holdfast.Clip, turned[:, :54], demo.trans)


FIXTURES = Path(__file__).parents[1] / "fixtures"


def test_imported_clips_bring_the_mesh_of_their_object(tmp_path):
    sequence = FIXTURES / "parameters/grab/grab/s1/mug_drink_1.npz"
    clip = holdfast.import_motion(sequence)
    mesh = holdfast.load_mesh(FIXTURES / "parameters/grab/tools/object_meshes/contact_meshes/mug.ply")
    for found, right in zip(clip.object.surface, mesh):
        np.testing.assert_array_equal(found, right)
    # It stays with what is made of the clip, and goes with nothing else.
    surface = clip.object.surface
    part = clip.resample(60.0)[:2].copy()
    del clip
    np.testing.assert_array_equal(part.object.surface[0], surface[0])
    surface[0][:] = 0.0  # a copy
    np.testing.assert_array_equal(part.object.surface[0], mesh[0])
    assert holdfast.score(part)["values"]["penetration_max_mm"] is not None
    holdfast.render(part, tmp_path / "frame.png", frame=0, size=(32, 24))
    assert part.with_object(None).object is None
    assert holdfast.Clip.load("demo_drink").object is None


def test_a_track_with_a_mesh_of_its_own():
    vertices, faces = holdfast.load_mesh("apple")
    clip = holdfast.Clip.load("demo_drink")[:3]
    track = holdfast.ObjectTrack(clip.trans, np.zeros((3, 3)), surface=(vertices, faces))
    assert holdfast.ObjectTrack(clip.trans, clip.trans).surface is None
    found = clip.with_object(track).object.surface
    np.testing.assert_array_equal(found[0], vertices)
    np.testing.assert_array_equal(found[1], faces)
    with pytest.raises(ValueError, match="surface"):
        holdfast.ObjectTrack(clip.trans, clip.trans, surface=(vertices, faces + len(vertices)))


def test_what_may_be_wrong_in_a_file_is_logged_as_a_warning(demo, tmp_path, caplog):
    path = tmp_path / "no_rate.npz"
    np.savez(path, poses=demo.poses, trans=demo.trans)
    with caplog.at_level(logging.WARNING, "holdfast"):
        clip = holdfast.import_motion(path)
    assert clip.frame_rate == 30 and len(clip) == len(demo)
    assert any("no frame rate" in record.message for record in caplog.records)


def test_a_hand_in_matrices_is_imported(tmp_path):
    path = tmp_path / "hand.npz"
    np.savez(
        path,
        global_orient=np.full((5, 3), 0.1),
        hand_pose=np.broadcast_to(np.eye(3), (5, 15, 3, 3)),
        transl=np.zeros((5, 3)),
        betas=np.zeros((5, 10)),
    )
    # Without a file of MANO, the hand of the embedded body stands for it, its wrist at MANO's.
    clip = holdfast.import_motion(path)
    np.testing.assert_allclose(np.asarray(clip.poses)[:, :3], 0.1)
    np.testing.assert_allclose(holdfast.joint_positions(clip)[:, 0], [[0.0957, 0.0064, 0.0062]] * 5, atol=1e-12)


def test_a_pair_of_files_is_one_clip():
    clip = holdfast.import_motion(FIXTURES / "cases/interact_pair/human.npz")
    angles = np.load(FIXTURES / "cases/interact_pair/object.npz")["angles"]
    np.testing.assert_allclose(clip.object.orient, angles)
    assert clip.object.name == "boxsmall"
