# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import holdfast
from support import refused


def reach(goals, **options):
    try:
        return holdfast.reach(goals, samples=2, **options)
    except holdfast.Error as error:
        if "files inside" in str(error):
            pytest.skip(str(error))
        raise


def test_reach_ranks_motions():
    result = reach([1.2, 0.5, 1.1])
    assert len(result.clips) == 2 and result.clip.poses.shape[1] == 165
    assert result.clip.frame_rate == 30.0
    assert result.reached.shape == (1,) and result.reached.dtype == bool
    assert len(result.misses) == len(result.goals) == 1
    assert (result.misses[0] is None) == bool(result.reached[0])
    assert result.goals[0]["goal_m"] == [1.2, 0.5, 1.1]
    assert [q["sample"] for q in result.quality] in ([0, 1], [1, 0])
    assert result.seconds > 0.0
    again = reach(np.array([[1.2, 0.5, 1.1]]), threads=1)
    np.testing.assert_array_equal(again.clip.poses, result.clip.poses)


def test_reach_goes_on_from_a_clip():
    result = reach([[0.5, -1.0, 1.0], [1.0, -1.5, 1.2]], clip="demo_drink", frame=10, wrist="left")
    assert result.reached.shape == (2,)


def test_reach_too_high_is_missed():
    result = reach([0.5, -0.5, 2.9])
    assert not result.reached[0] and "too high" in result.misses[0] and result.warnings


@pytest.mark.parametrize(
    "goals, options",
    [
        ([], {}),
        (np.zeros((0, 3)), {}),
        ([1.0, 2.0], {}),
        ([1.0, np.nan, 1.0], {}),
        ([1.0, 1.0, -1.0], {}),
        ([100.0, 0.0, 1.0], {}),
        ([1e9, 0.0, 1.0], {}),
        ([1.0, 1.0, 1.0], {"wrist": "up"}),
        ([1.0, 1.0, 1.0], {"method": "magic"}),
        ([1.0, 1.0, 1.0], {"time_s": 0.0}),
        ([1.0, 1.0, 1.0], {"sigma": -1.0}),
        ([1.0, 1.0, 1.0], {"sigma": float("nan")}),
        ([1.0, 1.0, 1.0], {"frame": 3}),
        ([1.0, 1.0, 1.0], {"clip": "demo_drink", "frame": -1}),
        ([1.0, 1.0, 1.0], {"clip": "demo_drink", "frame": 100000}),
        ([1.0, 1.0, 1.0], {"approach": [0, 0, 0]}),
        ([1.0, 1.0, 1.0], {"approach": [1, 0, 0], "free_time": True}),
        ([1.0, 1.0, 1.0], {"obstacles": [(np.eye(3), [[0, 1, 2]])]}),
        ([1.0, 1.0, 1.0], {"obstacles": [(np.eye(3), [[0, 1, 7]])], "method": "latent-opt"}),
        ([1.0, 1.0, 1.0], {"weights": "no such file.safetensors"}),
    ],
)
def test_reach_refuses_what_is_wrong(goals, options):
    refused(ValueError, "", holdfast.reach, goals, **options)


def test_reach_type_errors_and_stop():
    refused(TypeError, "", holdfast.reach, None)
    refused(TypeError, "", holdfast.reach, [1.0, 1.0, 1.0], obstacles=3)
    refused(ValueError, "", holdfast.reach, [1.0, 1.0, 1.0], samples=0)
    refused(holdfast.Stopped, "", reach, [1.0, 1.0, 1.0], progress=lambda stage, done, total: False)


def test_synthesize_and_fit():
    try:
        made = holdfast.synthesize("drink", "mug", samples=1, key_frames=6, seconds=1.0)
    except holdfast.Error as error:
        if "files inside" in str(error):
            pytest.skip(str(error))
        raise
    assert made.action == "drink" and made.object_class == "mug"
    assert "mug" in made.sentence
    assert len(made.clip) == len(made.motion)
    assert made.clip.object is not None and made.fit.status == "carried"
    assert made.samples[0]["sample"] == 0 and made.switch_frame is None


@pytest.mark.parametrize(
    "action, options",
    [
        ("fly", {}),
        ("drink", {"object_class": "spaceship"}),
        ("drink", {"samples": 0}),
        ("drink", {"key_frames": 4}),
        ("drink", {"seconds": 0.1}),
        ("drink", {"sigma": 9.0}),
        ("drink", {"start": "floor"}),
        ("drink", {"hand": "third"}),
        ("offhand", {"hand": "both"}),
        ("lift", {"hand": "both", "start": "table"}),
        ("drink", {"frame": 3}),
        ("drink", {"betas": np.ones(1000)}),
        ("drink", {"clip": "demo_drink", "frame": -1}),
        ("drink", {"clip": "demo_drink", "hand": "left"}),
        ("drink", {"weights": "no such file.safetensors"}),
    ],
)
def test_synthesize_refuses_what_is_wrong(action, options):
    refused(ValueError, "", holdfast.synthesize, action, "mug", **options)


def test_reach_takes_an_object():
    places = [[0.3, -1.3, 0.8], [0.6, -0.9, 1.1]]
    try:
        taken = reach(places, object="mug", method="intention", seed=3)
    except holdfast.FitFailure as failure:
        pytest.fail(str(failure))
    clip = taken.clip
    at = taken.take["frames"]["taken"]
    assert taken.hand == "right" and "mug" in repr(taken)
    assert not clip.holding_hand[: at - 1].any() and clip.holding_hand[-1] == 1
    np.testing.assert_array_equal(clip.object.surface[0], taken.object[0])
    assert np.linalg.norm(clip.object.trans[at] - clip.object.trans[0]) < 0.01
    assert len(taken.quality["goal_distance_m"]) == 1
    assert len(taken.per_frame["object_tilt_deg"]) == len(clip) == taken.quality["frames"]
    assert taken.table[0][:, 2].max() == pytest.approx(0.8, abs=1e-6)
    assert isinstance(taken.warnings, list) and taken.take["grasp"]["style"]
    refused(holdfast.Stopped, "", reach, places, object="mug", progress=lambda *_: False)


@pytest.mark.parametrize("options", [
    {"object": "mug", "grasp": "soft"}, {"object": "mug", "object_yaw_deg": 400.0},
    {"object": "mug", "object_scale": 0.0}, {"object": "no such mesh"}, {"grasp": "power"},
    {"object_yaw_deg": 3.0}, {"object_scale": 2.0},
])
def test_reach_refuses_a_wrong_take(options):
    refused(ValueError, "", holdfast.reach, [[0.3, -1.3, 0.8]], **options)


def test_a_goal_that_moves_is_followed_frame_by_frame():
    follower = holdfast.GoalFollower(candidates=4, horizon=6, seed=2)
    again = holdfast.GoalFollower(candidates=4, horizon=6, seed=2)
    for frame in range(12):
        goal = (0.02 * frame, -0.5, 1.1)
        if frame == 5:
            follower.push((0.1, 0, 0))
            again.push((0.1, 0, 0))
        pose, trans = follower.step(goal)
        assert pose.shape == (55, 3) and trans.shape == (3,)
        same = again.step(goal)
        assert np.array_equal(pose, same[0]) and np.array_equal(trans, same[1])
    clip = follower.clip
    assert len(clip) == 13
    assert np.allclose(clip.trans[-1], trans)
    refused(holdfast.Error, "above the ground", follower.step, (0, 0, -1))
    refused(holdfast.Error, "1 m", follower.push, (5, 0, 0))
    refused(ValueError, "candidates", holdfast.GoalFollower, candidates=0)
