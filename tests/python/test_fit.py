# SPDX-License-Identifier: MIT
import re

import numpy as np
import pytest

import holdfast
from support import refused


def test_fit_carries_the_object(held):
    assert held.status == "carried" and held.held_by in ("right", "left", "both")
    assert held.clip.object.trans.shape == (12, 3)
    assert len(held.clip.holding_hand) == 12
    assert np.isfinite(held.clip.poses).all()
    assert held.energies["energy_penetration_m2"].shape == (12,)
    assert held.per_frame["in_contact"].any()
    assert held.per_frame["stop"][0] == "given"
    assert 0.0 < held.contact["frames_in_contact_ratio"] <= 1.0
    vertices, faces = held.object
    assert vertices.shape[1] == faces.shape[1] == 3
    assert held.grasp["made"] and held.grasp["fingers"].shape == (45,)
    assert held.seconds > 0.0 and "mug" in repr(held)


def test_fit_serves_who_drinks(held):
    assert held.drink is None
    served = holdfast.fit("demo_drink", "mug", drink=True)
    drink = served.drink
    assert drink["hand"] == "right"
    assert drink["lift_frame"] < drink["drink_frame"] < drink["put_down_frame"]
    assert drink["rim_from_mouth_mm"] < 20.0
    assert drink["lean_on_table_deg"] < 2.0


def test_fit_does_not_depend_on_threads(held):
    again = holdfast.fit(holdfast.Clip.load("demo_drink")[:12], "mug", threads=1)
    np.testing.assert_array_equal(again.clip.poses, held.clip.poses)
    np.testing.assert_array_equal(again.clip.object.trans, held.clip.object.trans)


def test_fit_keeps_the_given_clip():
    clip = holdfast.Clip.load("demo_drink")[:3]
    poses = clip.poses.copy()
    holdfast.fit(clip, "bottle", hand="right", regrasp=True)
    np.testing.assert_array_equal(clip.poses, poses)


def test_fit_of_arrays_and_paper(held):
    clip = held.clip[:4]
    fitted = holdfast.fit(clip, held.object, keep_grasp=True, recipe="paper")
    assert len(fitted.clip) == 4
    heavier = holdfast.fit(clip, "mug", weights={"penetration": 0.0, "object_in_hand": 0.0})
    assert not heavier.energies["energy_penetration_m2"].any() and not heavier.grasp["made"]


def test_progress_sees_stages_and_stops(held):
    stages = set()
    clip = held.clip[:4]
    holdfast.fit(clip, "mug", progress=lambda stage, done, total: stages.add(stage))
    assert {"fit", "metrics"} <= stages
    refused(holdfast.Stopped, "", holdfast.fit, clip, "mug", progress=lambda stage, done, total: False)

    def fails(stage, done, total):
        raise KeyError("mine")

    refused(KeyError, "mine", holdfast.fit, clip, "mug", progress=fails)


@pytest.mark.parametrize(
    "options",
    [
        {"hand": "third"},
        {"style": "soft"},
        {"recipe": "best"},
        {"solve": "twice"},
        {"precision": "half"},
        {"weights": {"gravity": 1.0}},
        {"weights": {"penetration": -1.0}},
        {"weights": {"penetration": float("nan")}},
        {"contact_threshold_mm": 0.0},
        {"contact_threshold_mm": float("inf")},
        {"object_vertices": 3},
        {"object_scale": 0.0},
        {"object_scale": float("nan")},
        {"max_iterations": 0},
        {"threads": -1},
        {"keep_grasp": True, "regrasp": True},
        {"keep_grasp": True, "at": [0, 0, 0]},
        {"at": [0, 0]},
        {"at": [9, 9, 9]},
        {"region": (np.zeros((3, 3)), [[0, 1, 3]])},
        {"region": (np.zeros((3, 3)), np.zeros((0, 3), int))},
        {"avoid_balls": [0, 0, 0, 0.01]},
        {"avoid_balls": [[0, 0, 0, -0.01]]},
        {"switch_frames": [3]},
        {"hand_over": True, "switch_frames": [3, 2]},
        {"hand_over": True, "switch_frames": [-1]},
        {"hand_over": True, "switch_frames": [5000]},
        {"first_hand": "both"},
        {"dwell_s": -1.0},
    ],
)
def test_bad_options_are_value_errors(options):
    refused(ValueError, "", holdfast.fit, holdfast.Clip.load("demo_drink")[:6], "mug", **options)


@pytest.mark.parametrize(
    "options",
    [{"weights": 3.0}, {"body": "neutral"}, {"progress": 1}, {"seed": -1}, {"nonsense": 1},
     {"region": 3}, {"hand": None}],
)
def test_wrong_types_are_type_errors(options):
    refused(TypeError, "", holdfast.fit, holdfast.Clip.load("demo_drink")[:6], "mug", **options)


def test_unknown_object_and_clip():
    refused(holdfast.Error, "", holdfast.fit, "demo_drink", "no such object")
    refused(holdfast.Error, "", holdfast.fit, "no such clip", "mug")
    refused(TypeError, "", holdfast.fit, 3, "mug")


def test_fit_failures_speak_python():
    with pytest.raises((holdfast.FitFailure, holdfast.Error)) as raised:
        holdfast.fit(holdfast.Clip.load("demo_drink")[:2], "mug", object_scale=5.0, hand="right")
    assert issubclass(holdfast.FitFailure, RuntimeError)
    if raised.type is holdfast.FitFailure:
        assert "--" not in str(raised.value) and "object_scale" in str(raised.value)


def test_offhand_is_fit_with_hand_over():
    clip = holdfast.Clip.load("demo_drink")[:6]
    refused(TypeError, "", holdfast.offhand, clip, "apple", hand_over=False)
    refused(ValueError, "", holdfast.offhand, clip, "apple", switch_frames=[5000])


def test_save_is_a_result_folder(held, tmp_path):
    held.save(tmp_path / "held")
    again = holdfast.Clip.load(str(tmp_path / "held"))
    np.testing.assert_allclose(again.object.trans, held.clip.object.trans)
    assert (tmp_path / "held" / "object.ply").is_file()


def test_no_other_mesh_stands_in_for_a_results_own(held, tmp_path):
    held.save(tmp_path / "held")
    mesh = tmp_path / "held" / "object.ply"
    whole = mesh.read_bytes()
    assert holdfast.score(str(tmp_path / "held"))["frames"] == 12
    for broken in (whole[: len(whole) // 2], None):
        mesh.unlink() if broken is None else mesh.write_bytes(broken)
        clip = holdfast.Clip.load(str(tmp_path / "held"))  # the motion is there all the same
        assert clip.object.surface is None
        for given in (str(tmp_path / "held"), clip):
            refused(holdfast.Error, "object.ply", holdfast.score, given)
    assert holdfast.score(str(tmp_path / "held"), "mug")["frames"] == 12


def test_refine_before_and_after(held):
    refined = holdfast.refine(held.clip, held.object, hand="clip")
    assert len(refined.clip) == len(held.clip)
    assert refined.distance["mm"].shape == (12,)
    assert refined.distance["rms_mm"] >= 0.0
    assert set(refined.before) == set(refined.after)
    assert refined.holds and refined.holds[0]["end"] <= 12
    assert refined.solve["iterations"] >= 0
    assert [hand["hand"] for hand in refined.fingers] == ["right", "left"]
    assert refined.after["frames_with_finger_jumps"] == 0 and not refined.ball
    tips = [refined.after["fingertips_" + what] for what in ("touch", "beside", "inside")]
    assert sum(tips) == 5 * refined.after["hand_frames_held"] == 5 * 12
    by_name = holdfast.refine(held.clip, hand="clip")
    np.testing.assert_allclose(by_name.clip.object.trans, refined.clip.object.trans, atol=1e-3)


def test_the_clips_own_object_is_the_object(held, tmp_path):
    vertices, faces = held.clip.object.surface
    np.testing.assert_array_equal(vertices, held.object[0])
    own = holdfast.fit(held.clip[:3])
    assert not own.grasp["made"] and own.object_name == "mug"
    np.testing.assert_allclose(own.object[0], vertices)
    np.testing.assert_array_equal(held.clip[:3].copy().object.surface[1], faces)
    other = holdfast.fit(held.clip[:2], "apple", hand="right")
    assert other.grasp["made"] and other.clip.object.surface[0].shape != vertices.shape
    refused(holdfast.Error, "not the object", holdfast.refine, held.clip, "apple")
    # From the folder that it was saved in; and where nothing is known, that is said.
    held.save(tmp_path / "held")
    again = holdfast.Clip.load(tmp_path / "held")
    np.testing.assert_allclose(again.object.surface[0], vertices, atol=1e-6)
    track = holdfast.ObjectTrack(held.clip.object.trans, held.clip.object.orient, name="thing")
    for job in (holdfast.fit, holdfast.refine):
        refused(holdfast.Error, "mesh is missing", job, held.clip.with_object(track))
    refused(holdfast.Error, "has no object", holdfast.fit, "demo_drink")


def test_refine_needs_an_object():
    clip = holdfast.Clip.load("demo_drink")[:4]
    assert clip.object is None
    refused(holdfast.Error, "", holdfast.refine, clip, "mug")
    refused(ValueError, "", holdfast.refine, "demo_drink", "mug", hand="nobody")


def test_grasp_by_a_standing_person():
    grasp = holdfast.grasp("apple", closings=60, refinements=8)
    assert len(grasp.clip) == 1 and grasp.hand == "right"
    assert grasp.numbers["fingers"].shape == (45,)
    matrix = grasp.numbers["wrist_from_object"]
    np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=1e-9)
    np.testing.assert_array_equal(matrix[3], [0, 0, 0, 1])
    assert "thumb" in grasp.numbers["touching"]
    refused(ValueError, "", holdfast.grasp, "apple", clip="demo_drink")
    refused(ValueError, "", holdfast.grasp, "apple", closings=0)
    refused(holdfast.Stopped, "", holdfast.grasp, "apple", progress=lambda *_: False)


def test_many_distinct_grasps():
    many = holdfast.grasps("apple", 3)
    assert many["wrist_from_object"].shape == (3, 4, 4) and many["finger_pose"].shape == (3, 45)
    np.testing.assert_allclose(
        many["wrist_from_object"] @ many["object_from_wrist"], np.tile(np.eye(4), (3, 1, 1)), atol=1e-12)
    assert (many["least_friction"] <= 0.5).all() and (many["ball_lower"] <= many["ball_upper"]).all()
    assert set(many["style"]) <= {"power", "precision"} and len(many["clip"]) == 3
    assert (np.maximum(many["skin_in_object_mm"], many["object_in_hand_mm"]) < 1).all()
    refused(ValueError, "", holdfast.grasps, "apple", 0)
    refused(holdfast.Stopped, "", holdfast.grasps, "apple", 3, progress=lambda *_: False)


def object_pose(clip, frame):
    return clip.object.orient[frame], clip.object.trans[frame]


def test_frame_fitter_follows_the_hand(held):
    clip = held.clip
    fitter = holdfast.FrameFitter(held.object, held.held_by, frame_rate=clip.frame_rate)
    rotation, translation, fingers = fitter.start(clip.poses[0], clip.trans[0],
                                                  *object_pose(clip, 0))
    assert rotation.shape == (3, 3) and translation.shape == (3,) and fingers.shape == (45,)
    assert fitter.report["stop"] == "given" and fitter.report["contact_pairs"] > 0
    for frame in range(1, len(clip)):
        rotation, translation, fingers = fitter.step(clip.poses[frame], clip.trans[frame])
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
        assert np.linalg.norm(translation - clip.object.trans[frame]) < 0.01
    assert fitter.report["stop"] in ("converged", "iteration_limit")
    hand = slice(75, 120) if held.held_by == "left" else slice(120, 165)
    np.testing.assert_array_equal(fitter.poses[hand], fingers)
    # A second start forgets the first one, and a matrix is as good as an axis-angle.
    first = fitter.start(clip.poses[0], clip.trans[0], *object_pose(clip, 0))
    again = fitter.start(clip.poses[0], clip.trans[0], first[0], first[1])
    np.testing.assert_allclose(again[1], first[1], atol=1e-3)


@pytest.mark.parametrize("hand", ["one", "both"])
def test_frame_fitter_is_the_fit(held, hand):
    base = held if hand == "one" else holdfast.fit(
        holdfast.Clip.load("demo_drink")[:6], "mug", hand="both", regrasp=True)
    clip, side = base.clip, base.held_by
    fitted = holdfast.fit(clip, base.object, keep_grasp=True, hand=side)
    fitter = holdfast.FrameFitter(
        base.object, ["left", "right"] if side == "both" else side, frame_rate=clip.frame_rate)
    assert fitter.hand == side
    for frame in range(len(clip)):
        body = clip.poses[frame], clip.trans[frame]
        rotation, translation, fingers = (
            fitter.step(*body) if frame else fitter.start(*body, *object_pose(clip, 0)))
        # What differs is the rounding of wrists that were moved by nothing.
        np.testing.assert_allclose(translation, fitted.clip.object.trans[frame], atol=1e-6)
        np.testing.assert_allclose(fitter.poses, fitted.clip.poses[frame], atol=1e-5)
        assert fitter.report["energy_total"] == pytest.approx(
            fitted.energies["energy_total"][frame], rel=1e-3)
        assert rotation.shape == (3, 3) and fitter.report["wrist_offset_mm"] >= 0.0
        if side == "both":  # right and left; poses have them the other way round
            assert fingers.shape == (2, 45)
            np.testing.assert_array_equal(fitter.poses[75:], fingers[::-1].ravel())
    assert fitter.report["contact_pairs"] == fitted.contact["contact_pairs"]


def tilt(frame, q):
    x, y, z, w = q
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x)])


def tilt_with_jacobian(frame, q):
    x, y, z, w = q
    return tilt(frame, q), [2 * np.array([[z, w, x, y], [-w, z, y, -x]])]


@pytest.mark.parametrize("function", [tilt, tilt_with_jacobian])
def test_custom_terms_are_minimized_with_the_others(held, function):
    term = holdfast.CustomTerm("upright", ["object_rotation"], function, 2, weight=1e5)
    upright = holdfast.fit(held.clip, held.object, keep_grasp=True, custom_terms=[term])
    plain = holdfast.fit(held.clip, held.object, keep_grasp=True)
    energy = upright.per_frame["energy_upright"]
    assert energy[0] is None and (energy[1:] > 0.0).all() and not upright.warnings
    tilts = [[np.linalg.norm(tilt(0, quaternion(result.clip, t))) for t in range(1, 12)]
             for result in (plain, upright)]
    assert np.max(tilts[1]) < 0.2 * np.max(tilts[0])
    np.testing.assert_allclose(np.square(tilts[1]), energy[1:].astype(float), atol=1e-6)


def quaternion(clip, t):
    rotation, _ = object_pose(clip, t)
    angle = np.linalg.norm(rotation)
    return np.append(np.sin(angle / 2) * rotation / angle, np.cos(angle / 2))


@pytest.mark.parametrize("function, said", [
    (lambda frame, q: np.array([np.nan, 0.0]), "returned nan as residual 0"),
    (lambda frame, q: np.zeros(3), r"threw: residuals of shape \(3\), expected \(2\)"),
    (lambda frame, q: 1 / 0, "threw: ZeroDivisionError"),
])
def test_a_faulty_custom_term_keeps_the_frames_start_and_is_named(held, function, said):
    def in_frame_5(frame, q):
        return function(frame, q) if frame == 5 else np.zeros(2)
    term = holdfast.CustomTerm("faulty", ["object_rotation"], in_frame_5, 2)
    fitted = holdfast.fit(held.clip, held.object, keep_grasp=True, custom_terms=[term])
    assert fitted.per_frame["stop"][5] == "failed" and fitted.per_frame["stop"][6] != "failed"
    assert any(re.match("frame 5: custom term 'faulty' " + said, w) for w in fitted.warnings)


def test_custom_terms_refuse_what_is_wrong():
    for name, blocks, match in [("up right", ["object_rotation"], "name"),
                                ("distance", ["object_rotation"], "another term"),
                                ("upright", ["rotation"], "none is called 'rotation'"),
                                ("upright", [], "no parameter block")]:
        refused((ValueError, holdfast.Error), match, holdfast.CustomTerm, name, blocks, tilt, 2)


def test_frame_fitter_refuses_what_is_wrong():
    for hand in ("third", [], ["right", "third"]):
        refused(ValueError, "hand: expected", holdfast.FrameFitter, "mug", hand)
    refused(TypeError, "hand: expected", holdfast.FrameFitter, "mug", 3)
    refused(ValueError, "", holdfast.FrameFitter, "mug", frame_rate=0.0)
    refused(ValueError, "", holdfast.FrameFitter, "mug", betas=[1e9])
    fitter = holdfast.FrameFitter("mug")
    pose, trans = np.zeros(165), np.zeros(3)
    refused(RuntimeError, "start", fitter.step, pose, trans)
    for arguments in [
        (np.zeros(164), trans, np.eye(3), trans),
        (pose, np.zeros(2), np.eye(3), trans),
        (pose, trans, 2.0 * np.eye(3), trans),
        (pose, trans, np.diag([1.0, 1.0, -1.0]), trans),
        (pose, trans, np.zeros((2, 3)), trans),
        (pose, trans, np.eye(3), [np.nan, 0, 0]),
        (np.full(165, 1e6), trans, np.eye(3), trans),
        (pose, np.full(3, 1e9), np.eye(3), trans),
    ]:
        refused(ValueError, "", fitter.start, *arguments)
    refused(TypeError, "", fitter.start, None, trans, np.eye(3), trans)
    # Far from the object nothing touches, and nothing breaks.
    fitter.start(pose, trans, np.eye(3), [5.0, 0.0, 0.0])
    assert np.isfinite(fitter.step(pose.reshape(55, 3), trans)[1]).all()


def test_a_hand_stays_out_of_balls():
    center, radius = np.array([0.0, 0.0, 0.03]), 0.05  # the lower half of the bottle
    model = holdfast.BodyModel.load()

    def distance(**options):
        held = holdfast.grasp("bottle", **options)
        skin = model(held.clip.poses, held.clip.trans)[0][0][model.hand_vertex_ids(held.hand)]
        orient = held.clip.object.orient[0]
        angle = np.linalg.norm(orient)
        axis = orient / angle
        at = held.clip.object.trans[0] + (
            center * np.cos(angle) + np.cross(axis, center) * np.sin(angle)
            + axis * (axis @ center) * (1.0 - np.cos(angle)))
        return np.linalg.norm(skin - at, axis=1).min()

    assert distance() < radius < distance(avoid_balls=[[*center, radius]])
