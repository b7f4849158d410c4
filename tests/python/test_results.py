# SPDX-License-Identifier: MIT
"""What clips and results share: pickling, copies, saving, showing."""
import copy
import json
import multiprocessing
import pickle

import numpy as np
import pytest

import holdfast
from box_hand import write_box_hand
from support import refused


def same(a, b):
    """Whether two values hold the same numbers, clips included."""
    if isinstance(a, holdfast.Clip):
        return (np.array_equal(a.poses, b.poses) and np.array_equal(a.trans, b.trans) and a.frame_rate == b.frame_rate
                and np.array_equal(a.betas, b.betas) and np.array_equal(a.holding_hand, b.holding_hand)
                and (a.gender, a.model_type, a.body_model) == (b.gender, b.model_type, b.body_model)
                and (a.object is None) == (b.object is None) and (a.object is None or same(a.object, b.object)))
    if isinstance(a, holdfast.ObjectTrack):
        return (np.array_equal(a.trans, b.trans) and np.array_equal(a.orient, b.orient)
                and (a.name, a.mesh) == (b.name, b.mesh) and same(a.surface, b.surface))
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b


@pytest.mark.parametrize("copied", [lambda value: pickle.loads(pickle.dumps(value)), copy.copy, copy.deepcopy],
                         ids=["pickle", "copy", "deepcopy"])
def test_clips_and_results_are_copied_whole(held, copied):
    assert same(held.clip, copied(held.clip)) and copied(held.clip) is not held.clip
    assert same(held.clip.object, copied(held.clip.object))
    assert copied(holdfast.BodyModel.load()).name == holdfast.BodyModel.load().name
    stored = copied(held)
    assert "FitResult" in repr(stored)
    for name in ("metrics", "contact", "energies", "per_frame", "clip", "object", "seconds", "held_by"):
        assert same(getattr(held, name), getattr(stored, name)), name


def test_a_captured_clip_keeps_its_subject(tmp_path):
    clip = holdfast.Clip.load("demo_drink")[:3]
    clip.subject, clip.action = "s1", "drink"
    again = pickle.loads(pickle.dumps(clip))
    assert (again.subject, again.action, len(again)) == ("s1", "drink", 3)
    file = tmp_path / "robot.urdf"
    write_box_hand(file)
    hand = holdfast.RobotHand(file)
    assert pickle.loads(pickle.dumps(hand)).joints == hand.joints


def fitted(name):
    return holdfast.fit(holdfast.Clip.load("demo_drink")[:3], name)


def test_processes_return_results():
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        mug, bottle = pool.map(fitted, ["mug", "bottle"])
    assert (mug.object_name, bottle.object_name) == ("mug", "bottle")
    assert same(mug.clip, fitted("mug").clip)


def test_every_result_is_saved_and_shown(held, has_player, tmp_path):
    refined = holdfast.refine(held.clip)
    moved = holdfast.transfer(held.clip, "bottle", from_object="mug")
    grasp = holdfast.grasp("mug")
    for number, result in enumerate([held, refined, moved, grasp, pickle.loads(pickle.dumps(refined))]):
        folder = tmp_path / str(number)
        result.save(folder)
        assert same(holdfast.Clip.load(folder).object.trans, result.clip.object.trans)
        assert isinstance(json.loads((folder / "metrics.json").read_text()), dict)
        refused(holdfast.Error, "exists", result.save, folder)
        result.save(folder, force=True)
        if has_player:
            page = result.show(height=300)
            assert "<html" in page.html and "height:300px" in page._repr_html_()
    if has_player:
        assert held.clip._repr_html_().startswith("<iframe srcdoc=")


def test_render_without_a_path_returns_the_pixels(held):
    one = holdfast.render(held, frame=3, size=(64, 48))
    assert one.shape == (48, 64, 3) and one.dtype == np.uint8 and one.std() > 5
    several = holdfast.render(held, every=3, size=(64, 48))
    assert several.shape == (4, 48, 64, 3) and np.array_equal(several[1], one)
    refused(holdfast.Error, "no frame|of a clip", holdfast.render, held, frame=99)
