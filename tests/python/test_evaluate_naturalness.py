# SPDX-License-Identifier: MIT
import csv
import math

import numpy as np
import pytest

import holdfast
from holdfast.evaluate import naturalness
from support import refused, results


def carried(frames, step=(0.0, 0.0), subject=""):
    """Stands upright in the rest pose, facing -y, soles on the ground; moved by `step` a frame."""
    vertices, joints = holdfast.BodyModel.load()(np.zeros((1, 165)))
    poses = np.zeros((frames, 165))
    poses[:, 0] = math.pi / 2
    trans = np.zeros((frames, 3))
    trans[:, :2] = np.outer(np.arange(frames), step)
    trans[:, 2] = joints[0, 0, 1] - vertices[0, :, 1].min()
    clip = holdfast.Clip(poses, trans - joints[0, 0], frame_rate=30.0)
    clip.subject = subject
    return clip


def measured(clip, **more):
    return naturalness.measures_of(holdfast.walk(clip, **more))


def test_a_body_that_is_carried_slides():
    angle, speed = math.radians(30.0), 1.2
    step = np.array([math.sin(angle), -math.cos(angle)]) * speed / 30
    values, curves, way_m = measured(carried(121, step), skating=True)
    assert way_m == pytest.approx(4.8)
    for key in ("speed_moving_m_s", "speed_p95_m_s", "speed_peak_m_s"):
        assert values[key] == pytest.approx(speed)
    assert values["fastest_fifth_ratio"] == pytest.approx(0.2)
    assert values["half_way_ratio"] == pytest.approx(0.5)
    assert values["heading_off_deg"] == pytest.approx(30.0)
    assert values["none_planted_ratio"] == values["skating_ratio"] == values["skating_joints_ratio"] == 1
    for key in ("speeding_ratio", "sideways_ratio", "left_planted_ratio", "airborne_ratio"):
        assert values[key] == 0, key
    assert values["acceleration_m_s2"] == pytest.approx(0, abs=1e-9)
    assert values["pelvis_bob_m"] == pytest.approx(0, abs=1e-9)
    assert math.isnan(values["step_length_m"]) and math.isnan(values["arm_leg_correlation"])
    assert "beyond_limits_ratio" not in values
    np.testing.assert_allclose(curves["speed_profile"], speed)
    assert sum(curves["headings"]) == pytest.approx(1)


def test_a_body_that_stands_has_its_feet_on_the_ground():
    walk = holdfast.walk(carried(60), skating=True)
    assert walk["joints"].shape == walk["mean_joints"].shape == (60, 22, 3)
    assert (walk["contacts"] == 0b1111).all() and not walk["cut"]
    assert walk["foot_skating_ratio"] == 0 and walk["second_crouch"] == -1
    values, _, way_m = naturalness.measures_of(walk, limits=[0.1] * 22)
    assert way_m == 0 and values["sole_depth_m"] < 0.02 and values["contact_drift_m"] == 0
    assert math.isnan(values["speed_moving_m_s"]) and values["beyond_limits_ratio"] == 0


def test_steps_are_told_from_contacts():
    """The right foot stands, steps 0.8 m in 12 frames, 10 cm high, and stands again; so does the left."""
    soles = np.zeros((100, 4, 3))
    on_ground = np.ones((100, 4), bool)
    for foot, lift in ((2, 20), (0, 50), (2, 80)):
        on_ground[lift:lift + 12, foot:foot + 2] = False
        soles[lift:lift + 12, foot:foot + 2, 2] = 0.1
        soles[lift + 12:, foot:foot + 2, 0] += 0.8
    seconds, strides = naturalness.strides_of(on_ground, soles)
    assert seconds == [48 / 30]  # the right foot's, between its two steps
    lengths, heights, times = zip(*strides)
    np.testing.assert_allclose(lengths, 0.8)
    np.testing.assert_allclose(heights, 0.1)
    assert times[1] == 60 / 30 and math.isnan(times[0]) and math.isnan(times[2])


def test_arms_that_swing_with_the_opposite_legs():
    frames, at = 150, np.arange(150)
    joints = np.zeros((frames, 22, 3))
    joints[..., 1] -= 0.04 * at[:, None]  # 1.2 m/s along -y
    swing = 0.1 * np.sin(2 * np.pi * at / 33)  # as long as the usual stride of 1.1 s
    joints[:, 20, 1] -= 2 * swing  # the left wrist with the right ankle
    joints[:, 8, 1] -= swing
    joints[:, 21, 1] += 2 * swing
    joints[:, 7, 1] += swing
    joints[:, 12, 2] = 1.0
    walk = {"joints": joints, "yaw": np.zeros(frames), "soles": np.zeros((frames, 4, 3)), "hand": {"profile": []},
            "contacts": np.zeros(frames, np.uint8), "foot_skating_ratio": 0.0}
    values, curves, _ = naturalness.measures_of(walk)
    assert values["arm_swing_left_m"] == pytest.approx(0.2, rel=0.02)
    assert values["arm_leg_correlation"] == pytest.approx(1.0)
    assert values["lean_deg"] == 0 and values["power_0_1_hz_ratio"] > 0.5
    assert len(curves["power"]) == 61


def test_power_is_the_mean_square_of_its_band():
    t = np.arange(300) / 30
    signal = np.stack([2.0 * np.sin(2 * np.pi * 3.0 * t), np.cos(2 * np.pi * 6.0 * t)], 1)
    density = naturalness.power_spectrum(signal, np.ones(300))
    assert naturalness.power_between(density, 2, 4) == pytest.approx(2.0, rel=0.02)
    assert naturalness.power_between(density, 4, 8) == pytest.approx(0.5, rel=0.1)
    assert naturalness.power_between(density, 0, 15) == pytest.approx(2.5, rel=0.02)
    assert naturalness.power_spectrum(signal[:15], np.ones(15)) is None
    # Windows in which nobody moves do not count, unless nobody ever does.
    moving = np.concatenate([np.zeros(150), np.ones(150)])
    half = np.concatenate([100.0 * signal[:150], signal[150:]])
    assert naturalness.power_between(naturalness.power_spectrum(half[64:], moving[64:]), 0, 15) > 2.5
    np.testing.assert_allclose(naturalness.power_spectrum(signal, np.zeros(300)), density)


def test_a_rush_is_told_from_an_even_way():
    half, fastest, profile = naturalness.pace(np.full(100, 1.0))
    assert half == pytest.approx(0.5) and fastest == pytest.approx(0.2) and len(profile) == 40
    late = np.concatenate([np.full(90, 0.2), np.full(10, 9.0), np.zeros(50)])
    half, fastest, _ = naturalness.pace(late)
    assert half > 0.9 and fastest > 0.8
    assert math.isnan(naturalness.pace(np.full(10, 0.05))[0])  # a sway makes no way


def test_distances_of_sets():
    assert naturalness.wasserstein([0, 1, 3], [5, 6, 8]) == 5
    assert naturalness.wasserstein([0, 1], [0, 1, 0, 1]) == 0
    assert naturalness.wasserstein([0, 0], [0, 1]) == 0.5
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=60), rng.normal(3.0, size=40)
    far = naturalness.distance_of(a, b, 0.1, seed=5)
    assert far == naturalness.distance_of(a, b, 0.1, seed=5)
    assert far["distance"] == pytest.approx(naturalness.wasserstein(a, b) / a.std(ddof=1))
    assert far["distance"] > far["distance_by_chance"] > 0 and far["cohens_d"] > 2
    near = naturalness.distance_of(a[:30], a[30:], 0.1, seed=5)
    assert near["distance"] < 2 * near["distance_by_chance"]
    # A deviation is at least what an eye can tell.
    assert naturalness.distance_of([1.0, 1.0], [2.0], 0.5, seed=1)["distance"] == 2.0
    assert math.isnan(naturalness.distance_of([], [1.0], 0.5, seed=1)["distance"])


def test_motions_that_differ_by_place_and_turn_are_the_same():
    walk = holdfast.walk(carried(40, (0.0, -0.03)))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = {"mean_joints": walk["mean_joints"] @ turn.T + [3.0, 1.0, 0.0], "yaw": walk["yaw"] + math.pi / 2}
    assert naturalness.pair_distance([walk, turned]) == pytest.approx(0, abs=1e-9)
    ends = {key: walk[key][:20] for key in ("mean_joints", "yaw")}  # who ends first stays where it is
    assert naturalness.pair_distance([walk, ends]) == pytest.approx(0.03 * np.arange(21).sum() / 40)
    assert math.isnan(naturalness.pair_distance([walk]))


def test_joint_limits_leave_out_a_thousandth():
    angles = np.full((1001, 22), 0.5)
    angles[:, 3] = 0.1
    angles[0, 5] = 3.0
    limits = np.degrees(naturalness.limits_of(angles))
    assert limits[0] == 180 and limits[3] == pytest.approx(20)  # at least 17 degrees, plus 3
    assert limits[5] == pytest.approx(math.degrees(0.5) + 3)


@pytest.fixture(scope="module")
def sets(tmp_path_factory):
    """'captured' with four that are carried about as fast as each other, 'rushed' with a fast one and
    one that stands; clip.npz is the best of its samples."""
    folder = tmp_path_factory.mktemp("sets")
    for k in range(4):
        path = folder / "captured" / "person" / f"walk_{k}.npz"
        path.parent.mkdir(parents=True, exist_ok=True)
        carried(60 + 10 * k, (0.0, -(0.95 + 0.03 * k) / 30)).save(path)
    (folder / "rushed" / "samples").mkdir(parents=True)
    for name, clip in (("clip", carried(60, (0, -0.08))), ("samples/00", carried(60, (0, -0.08))),
                       ("samples/01", carried(60, (0, -0.09))), ("samples/02", carried(60))):
        clip.save(folder / "rushed" / f"{name}.npz")
    return folder


def run(*arguments):
    assert naturalness.main([*map(str, arguments), "--jobs", "1"]) == 0


def test_sets_side_by_side(sets, tmp_path, capsys):
    run(sets / "captured", "--against", f"ours={sets / 'rushed'}", "-o", tmp_path / "out")
    text = capsys.readouterr().out
    assert "captured: 4 motions, 4 of them walks" in text and "ours: 3 motions, 2 of them walks" in text
    assert text.strip() in (tmp_path / "out" / "evaluation.md").read_text()
    out = results(tmp_path / "out")
    by_key = {measure["key"]: measure["sets"] for measure in out["measures"]}
    assert by_key["speed_moving_m_s"][0]["mean"] == pytest.approx(0.995)
    assert by_key["speed_moving_m_s"][1]["mean"] == pytest.approx(2.55)
    assert by_key["speed_moving_m_s"][1]["motions"] == 2  # who stands is not asked
    assert by_key["speed_moving_m_s"][1]["distance"] > 10
    assert by_key["speeding_ratio"][1]["mean"] == pytest.approx(2 / 3)
    assert out["sets"][1]["set_apart_by"] and out["curves"]["speed_profile"]["sets"][1]["motions"] == 2
    with open(tmp_path / "out" / "motions.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 7 and rows[0]["motion"] == "person/walk_0" and rows[0]["frames"] == "60"

    # Hands have measures and a mean of their own; what is asked of the whole body does not change.
    run(sets / "captured", "--against", f"ours={sets / 'rushed'}", "--hands", "-o", tmp_path / "out")
    hands = results(tmp_path / "out")
    assert len(hands["measures"]) == len(out["measures"]) + 6 and "hand_speed" in hands["curves"]
    assert "| mean over the hand's measures |" in capsys.readouterr().out
    for key in ("mean_distance", "mean_distance_by_chance", "oddest"):
        assert hands["sets"][1][key] == out["sets"][1][key]


def test_what_is_compared_can_be_chosen(sets, tmp_path):
    run(sets / "captured", "--against", sets / "rushed", "--moving-only", "-o", tmp_path / "moving")
    assert results(tmp_path / "moving")["sets"][1]["motions"] == 2
    first, second = sets / "rushed/samples/00.npz", sets / "rushed/samples/01.npz"
    run(sets / "captured", "--at-most", 2, "--against", f"a={first}", "--against", f"b={sets / 'rushed'}",
        "--against", f"a={second}", "-o", tmp_path / "both", "--limits", sets / "captured")
    assert [(s["label"], s["motions"]) for s in results(tmp_path / "both")["sets"]] == [
        ("captured", 2), ("a", 2), ("b", 2)]


def test_reaches_are_made_from_a_list(sets, tmp_path):
    listed = tmp_path / "reaches.csv"
    listed.write_text("clip,frame,ahead,left,up\nperson/walk_0.npz,10,0.5,0.2,1.1\n")
    run(sets / "captured", "--reaches", listed, "--reaches-root", sets / "captured", "--methods", "intention",
        "-o", tmp_path / "out")
    out = results(tmp_path / "out")
    assert out["reaches"][0]["motions"] == 1 and out["sets"][1]["label"] == "intention"
    made = holdfast.Clip.load(tmp_path / "out" / "reaches" / "intention" / "000.npz")
    assert made.frame_rate == 30 and len(made) > 30
    for text, words in (("clip,frame\n", "is not 'clip,frame,ahead,left,up'"),
                        ("clip,frame,ahead,left,up\n", "lists no reaches"),
                        ("clip,frame,ahead,left,up\na.npz,0,1,0\n", ":2: is not a clip and four numbers"),
                        ("clip,frame,ahead,left,up\na.npz,-1,1,0,1\n", ":2: is not a clip and four numbers"),
                        ("clip,frame,ahead,left,up\na.npz,0,1,0,1\n", "names a clip that does not exist")):
        listed.write_text(text)
        refused(holdfast.Error, words, naturalness.read_reaches, listed, sets)


def test_what_is_wrong_is_said(sets, tmp_path):
    def fault(words, *arguments):
        refused(holdfast.Error, words, run, *arguments, "-o", tmp_path / "out")

    (tmp_path / "empty").mkdir()
    (tmp_path / "broken.npz").write_text("no archive")
    fault("broken.npz", tmp_path / "broken.npz")
    fault("contains no clip", tmp_path / "empty")
    fault("nowhere", sets / "captured", "--against", "nowhere")
    fault("is not a set", sets / "captured", "--against", "ours=")
    fault("name of the reference", sets / "captured", "--against", sets / "captured")
    fault("none of its 1 motions", sets / "captured", "--against", sets / "rushed/samples/02.npz", "--moving-only")
    refused(SystemExit, "", run, sets / "captured", "-o", tmp_path / "out", "--way", -1)
