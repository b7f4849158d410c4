# SPDX-License-Identifier: MIT
import json

import numpy as np
import pytest

import holdfast
from support import refused


@pytest.fixture(scope="module")
def model():
    return holdfast.BodyModel.load()


@pytest.fixture(scope="module")
def mano(model, tmp_path_factory):
    """A right hand cut off the embedded body, with two shape coefficients, in MANO's layout."""
    ids = model.hand_vertex_ids("right")
    vertices, joints = model(np.zeros((1, 165)))
    new = {old: k for k, old in enumerate(ids)}
    faces = np.array([[new[i] for i in face] for face in model.faces if all(i in new for i in face)])
    hand = [model.joint_names.index("right_wrist")] + list(range(40, 55))
    nearest = np.linalg.norm(vertices[0, ids][:, None] - joints[0, hand][None], axis=2).argmin(1)
    weights = np.eye(16)[nearest]
    regressor = weights.T / weights.sum(0)[:, None]
    path = tmp_path_factory.mktemp("mano") / "MANO_RIGHT.npz"
    np.savez(
        path,
        v_template=vertices[0, ids],
        shapedirs=np.stack([0.01 * vertices[0, ids], np.zeros((len(ids), 3))], axis=2),
        posedirs=np.zeros((len(ids), 3, 135)),
        J_regressor=regressor,
        weights=weights,
        kintree_table=np.array(
            [[4294967295, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11, 0, 13, 14], list(range(16))]
        ),
        f=faces,
        hands_mean=np.full(45, 0.1),
        hands_components=np.eye(45),
    )
    return holdfast.BodyModel.load(path)


def test_to_the_same_model(demo, model):
    converted = holdfast.convert(demo, to_body=model)
    assert np.allclose(converted.clip.poses, demo.poses)
    assert np.allclose(converted.clip.trans, demo.trans, atol=1e-6)
    assert converted.residual["max_mm"] < 1e-2 and converted.residual["vertex_max_mm"] < 1e-2
    assert set(converted.residual["joints"]) <= set(holdfast.JOINT_NAMES)
    assert converted.not_carried_over == [] and converted.arm is None
    assert converted.body.name == model.name
    assert "ConvertResult" in repr(converted)


def test_a_hand_alone_and_back_onto_its_body(demo, mano):
    hand = holdfast.convert(demo, to_body=mano)
    assert hand.clip.model_type == "mano" and len(hand.clip) == len(demo)
    assert "the body's motion" in hand.not_carried_over
    refused(holdfast.Error, "hand alone", holdfast.convert, hand.clip, from_body=mano, to_body=None)
    back = holdfast.convert(hand.clip, from_body=mano, to_body=None, onto=demo)
    assert back.arm["frames_out_of_reach"] == 0
    assert back.clip.model_type == demo.model_type
    assert np.allclose(back.clip.trans, demo.trans)
    with pytest.raises(holdfast.Error, match="frames"):
        holdfast.convert(hand.clip, from_body=mano, to_body=None, onto=demo[:3])


def test_save(demo, model, tmp_path):
    converted = holdfast.convert(demo, to_body=model)
    converted.save(tmp_path / "package.json")
    package = json.loads((tmp_path / "package.json").read_text())
    assert package["flat_hand_mean"] is True
    assert np.allclose(package["body_pose"], demo.poses[:, 3:66])
    converted.save(tmp_path / "clip.npz")
    assert np.allclose(holdfast.Clip.load(tmp_path / "clip.npz").poses, demo.poses)
    converted.save(tmp_path / "relative.json", to_hands="relative")
    again = holdfast.convert(tmp_path / "relative.json", to_body=model)
    assert np.allclose(again.clip.pose_hand, demo.pose_hand, atol=1e-9)
    refused(holdfast.Error, "Give smplx, amass or auto", converted.save, tmp_path / "x.npz", layout="mano")
    refused(ValueError, "layout: expected one of", converted.save, tmp_path / "x.npz", layout="grab")
    refused(ValueError, "to_hands: expected one of", converted.save, tmp_path / "x.npz", to_hands="flat")
    refused(holdfast.Error, "", converted.save, tmp_path / "x.txt")


def test_fingers_relative_to_the_mean_hand(demo, mano):
    hand = holdfast.convert(demo, to_body=mano).clip
    shifted = holdfast.convert(hand, from_body=mano, to_body=mano, from_hands="relative").clip
    assert np.allclose(shifted.poses[:, 120:165] - hand.poses[:, 120:165], 0.1)


def test_betas(demo, model):
    assert len(holdfast.convert(demo, to_body=model, betas=0).clip.betas) == 0


def test_wrong_arguments_are_said(demo, model):
    refused(TypeError, "", holdfast.convert, demo)
    refused(TypeError, "to_body: expected a BodyModel or None", holdfast.convert, demo, to_body="SMPLH.npz")
    with pytest.raises(TypeError, match="from_body: expected a BodyModel or None"):
        holdfast.convert(demo, to_body=model, from_body=3)
    with pytest.raises(ValueError, match="from_hands: expected one of 'auto', 'complete'"):
        holdfast.convert(demo, to_body=model, from_hands="flat")
    refused(ValueError, "betas", holdfast.convert, demo, to_body=model, betas=301)
    refused(TypeError, "onto: expected a Clip", holdfast.convert, demo, to_body=model, onto=3)
