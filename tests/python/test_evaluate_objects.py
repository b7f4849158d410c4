# SPDX-License-Identifier: MIT
"""Studies of fits, hand-overs, grasps, robots, markers and captures."""
import csv
import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

import holdfast
from box_hand import write_box_hand
from holdfast.evaluate import __main__ as program
from holdfast.evaluate import _study, captures, fit, handovers, hold, markers, transfer
from support import refused, results

DATA = Path(os.environ.get("HOLDFAST_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))


def test_the_program_lists_studies_and_tells_what_is_wrong(capsys, tmp_path):
    assert program.main(["--help"]) == 0 and program.main([]) == 2
    assert "markers" in capsys.readouterr().out
    assert program.main(["fits"]) == 2 and "no study 'fits'" in capsys.readouterr().err
    assert program.main(["captures", str(tmp_path / "none"), "-o", str(tmp_path / "out")]) == 1
    assert "is not a folder" in capsys.readouterr().err
    for study in ("fit", "handovers", "hold", "transfer", "markers", "captures"):
        with pytest.raises(SystemExit) as ended:
            program.main([study, "--help"])
        assert ended.value.code == 0 and "Example:" in capsys.readouterr().out


def test_a_list_has_fits_by_three_recipes(tmp_path, capsys):
    jobs = tmp_path / "list.txt"
    holdfast.Clip.load("demo_drink")[:6].save(tmp_path / "short.npz")
    jobs.write_text("short.npz mug name=a object-vertices=200\nnowhere.npz mug name=b\n")
    command = [str(jobs), "-o", str(tmp_path / "out"), "--handovers", "2", "--jobs", "1"]
    assert fit.main(command) == 1  # the second has no clip
    value = results(tmp_path / "out")
    first, second = value["clips"]
    for recipe in fit.RECIPES:
        assert first[recipe]["contact_frames_ratio"] == 1.0
        assert "nowhere.npz" in second[recipe]["fault"] or recipe != "paper"
        assert len(value["summary"][recipe]["faults"]) == 1
        assert holdfast.Clip.load(tmp_path / "out" / recipe / "a").poses.shape == (6, 165)
    assert first["holdfast"]["deep_penetration_frames_ratio"] == 0.0
    assert value["summary"]["paper"]["contact_drift_max_mm_worst"] == first["paper"]["contact_drift_max_mm"]
    assert value["handovers"] == {"clips": 2, "found_with_object": 2, "found_without_object": 2}
    text = (tmp_path / "out" / "evaluation.md").read_text()
    assert "| frames in contact | 100.0 % | 100.0 % | 100.0 % | at least 98 % |" in text
    assert "solve, ms per frame" in capsys.readouterr().out
    # A line cut off by an interrupt is computed again; what is complete is not.
    store = tmp_path / "out" / "fits.jsonl"
    lines = store.read_text().split("\n")
    lines[1] = lines[1].replace('"solve_ms": ', '"solve_ms": 1')
    store.write_text("\n".join([*lines[:2], lines[2][:20]]))
    before = text, results(tmp_path / "out")
    assert fit.main(command) == 1
    assert ((tmp_path / "out" / "evaluation.md").read_text(), results(tmp_path / "out")) == before
    assert lines[1] in store.read_text()
    refused(holdfast.Error, "--force", fit.main, [*command, "--seed", "2"])
    jobs.write_text("short.npz mug color=red\n")
    assert fit.main([*command, "--force"]) == 1
    assert "color" in results(tmp_path / "out")["clips"][0]["paper"]["fault"]


@pytest.mark.parametrize("line, text", [
    ("demo_drink", "expected a clip and an object"),
    ('demo_drink "mug', "quote"),
])
def test_a_list_that_is_wrong_is_told(tmp_path, line, text):
    (tmp_path / "list.txt").write_text(line + "\n")
    refused(holdfast.Error, text, fit.main, [str(tmp_path / "list.txt"), "-o", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()


def test_jobs_are_read_with_their_keys(tmp_path):
    (tmp_path / "cup.obj").write_text("")
    (tmp_path / "list.txt").write_text("# two\na.npz cup.obj hand=left lambda-contact=3\nb.npz cup.obj slip=true at=0,0.5,1\n")
    first, second = holdfast.read_jobs(tmp_path / "list.txt")
    assert first["words"] == ["a.npz", str(tmp_path / "cup.obj")] and first["name"] == "a_cup"
    assert first["keys"] == {"hand": "left", "lambda-contact": "3"} and second["where"].endswith("list.txt:3")
    first, second = fit.read_list(tmp_path / "list.txt")
    assert first["options"] == {"hand": "left", "lambda_contact": 3}
    assert second["options"] == {"hand": "right", "slip": True, "at": [0.0, 0.5, 1.0]}


def test_noisy_handovers_are_found():
    clips = [handovers.find_one(seed) for seed in range(1, 41)]
    assert sum(clip["found_with_object"] for clip in clips) >= 38
    assert sum(clip["found_without_object"] for clip in clips) >= 35  # the body alone says less
    assert np.mean([clip["hands_right_ratio"] for clip in clips]) > 0.9
    assert sum(len(clip["truth"]) for clip in clips) > 50  # several in some
    assert handovers.find_one(3) == clips[2]


def test_holds_of_a_clip_without_noise_are_its_own():
    clip, switches = holdfast.handover_clip("cube", seed=5, switches=1)
    found = holdfast.find_holds(clip, threads=1)
    assert len(switches) == len(found["switches"]) == 1
    assert abs(found["switches"][0]["frame"] - switches[0]) <= 2
    assert np.mean(found["holding_hand"] == clip.holding_hand) > 0.9
    apart = clip.with_object(None)
    apart.poses[:, 3 * 16:3 * 18] = 0.0  # arms stretched sideways
    refused(holdfast.Error, "", holdfast.find_handovers, apart, 0.07)
    refused(ValueError, "switches", holdfast.handover_clip, "cube", switches=21)


def test_a_mirrored_clip_changes_hands():
    clip = holdfast.Clip.load("demo_pass")[:20]
    twice = handovers.mirror(handovers.mirror(clip))
    assert np.array_equal(twice.poses, clip.poses) and np.allclose(twice.trans, clip.trans)
    was, now = holdfast.joint_positions(clip), holdfast.joint_positions(handovers.mirror(clip))
    right, left = handovers.WRISTS
    assert np.allclose(now[:, left], was[:, right] * [-1.0, 1.0, 1.0], atol=0.01)  # a body is nearly its mirror image


def test_hands_are_led_past_a_wineglass_no_faster_than_the_clip(tmp_path):
    command = ["wineglass", "--one-way", "--found", "1", "-o", str(tmp_path)]
    assert handovers.main([*command, "--jobs", "2"]) == 0
    value = results(tmp_path)
    assert value["passes"][0]["object"] == "wineglass" and not value["passes"][0]["mirrored"]
    assert value["summary"]["clean"] == value["summary"]["handovers"] == 1
    assert value["summary"]["max_penetration_depth_mm"] < 2.0
    assert value["summary"]["carrying_acceleration_ratio"] < 1.1
    assert value["summary"]["free_acceleration_ratio"] < 1.1
    assert value["summary"]["synthetic"]["clips"] == 1
    refused(holdfast.Error, "different configuration", handovers.main, [*command, "--keep-motion"])


def test_the_mean_of_passes_has_the_worst_depth_and_accelerations():
    row = {"handovers": 1, "clean": 1, "receiver_turned_deg": 3.0, "max_penetration_depth_mm": 0.5,
           "carrying_acceleration_ratio": 0.9, "free_acceleration_ratio": 0.7}
    other = {**row, "clean": 0, "receiver_turned_deg": 5.0, "free_acceleration_ratio": 0.8}
    total = handovers.mean_of([row, other, {"fault": "no hand touches"}])
    assert total == {**row, "handovers": 2, "receiver_turned_deg": 4.0, "free_acceleration_ratio": 0.8}
    assert handovers.mean_of([{"fault": "no hand touches"}]) is None
    assert handovers.cells("a", {"fault": "no hand touches"})[1] == "no hand touches"


def has_physics(held):
    try:
        holdfast.hold_trial(held, threads=2)
    except holdfast.Error as error:
        assert "MuJoCo" in str(error)
        return False
    return True


def test_grasps_are_tried(held, tmp_path):
    if not has_physics(held):
        pytest.skip("built without MuJoCo")
    big = tmp_path / "wall.obj"
    vertices, faces = holdfast.load_mesh("cube")
    big.write_text("".join("v {} {} {}\n".format(*8.0 * point) for point in vertices)
                   + "".join("f {} {} {}\n".format(*face + 1) for face in faces))
    assert hold.main(["sphere", str(big), "-o", str(tmp_path / "first"), "--jobs", "1"]) == 0
    value = results(tmp_path / "first")
    assert value["summary"] == {"objects": 2, "hold_all_six": 1, "share": 0.5}
    assert value["objects"][0]["trial"]["held_directions"] == 6 and value["objects"][1]["trial"] is None
    assert "wall" in value["objects"][1]["fault"] and value["protocol"]["friction"] == 0.8
    with open(tmp_path / "first" / "hold.csv") as file:
        first, second = csv.DictReader(file)
    assert (first["object"], first["trial_held_directions"]) == ("sphere", "6") and float(first["trial_mass_kg"]) > 0.0
    assert second["object"] == "wall" and second["fault"] and not second["trial_mass_kg"]
    assert hold.main(["sphere", "--count", "2", "-o", str(tmp_path / "many"), "--jobs", "1"]) == 0
    value = results(tmp_path / "many")
    assert value["summary"]["grasps"] == 2 and value["objects"][0]["object"] == "sphere"
    with open(tmp_path / "many" / "hold.csv") as file:
        rows = list(csv.DictReader(file))
    assert [(row["object"], row["grasp"]) for row in rows] == [("sphere", "0"), ("sphere", "1")]
    assert sum(row["held_directions"] == "6" for row in rows) == value["summary"]["hold_all_six"]
    slippery = holdfast.hold_trial(held, friction=0.0, threads=2)
    assert slippery["protocol"]["friction"] == 0.0
    assert slippery["worst_slip_mm"] != holdfast.hold_trial(held, threads=2)["worst_slip_mm"]
    refused(SystemExit, "", hold.main, ["sphere", "mug", "--film", "trial.gif", "-o", str(tmp_path / "film")])


def test_a_clip_is_transferred_by_several_methods(held, tmp_path):
    held.save(tmp_path / "held")
    urdf = write_box_hand(tmp_path / "boxes.urdf")
    command = [str(tmp_path / "held"), "--robot", str(urdf), "-o", str(tmp_path / "out"), "--jobs", "1"]
    assert transfer.main([*command, "--no-physics"]) == 0
    value = results(tmp_path / "out")
    rows = {row["method"]: row for row in value["rows"]}
    assert list(rows) == ["holdfast", *transfer.BASELINES.values(), "human hand"]
    assert [row["method"] for row in value["summary"]] == sorted(rows)
    assert all(row["frames"] == 12 and row["held_directions"] is None for row in rows.values())
    assert rows["holdfast"]["contact_distance_mm"] < rows["keypoint IK (as with Mink)"]["contact_distance_mm"]
    assert rows["human hand"]["press_direction_deg"] is None and rows["human hand"]["contact_distance_mm"] < 5.0
    times = json.loads((tmp_path / "out" / "timing.json").read_text())
    assert times["boxes, holdfast, ms per frame"] > 0.0 and "ms_per_frame" not in rows["holdfast"]
    with pytest.raises(holdfast.Error, match="does not exist"):
        transfer.main([command[0], "--robot", str(tmp_path / "none.urdf"), "-o", str(tmp_path / "none")])


def test_a_robot_hand_is_tried_as_the_human_hand_is(held, tmp_path):
    if not has_physics(held):
        pytest.skip("built without MuJoCo")
    moved = holdfast.transfer_to_robot(held, write_box_hand(tmp_path / "boxes.urdf"))
    own, human = moved.hold_trial(), moved.hold_trial(human=True)
    assert 0 <= own["held_directions"] <= 6 and human["held_directions"] == 6
    assert own["mass_kg"] == human["mass_kg"]
    refused(ValueError, "method", moved.baseline, "mink")


def test_a_transfer_is_played(held, tmp_path):
    if not has_physics(held):
        pytest.skip("built without MuJoCo")
    urdf = write_box_hand(tmp_path / "boxes.urdf")
    play = holdfast.transfer_to_robot(held, urdf).play()
    assert play["stable"] and play["holds"] == 1 and len(play["off_mm"]) == len(held.clip)
    assert play["off_mm"][0] < 1e-3 and 0.0 < play["most_mm"] == np.nanmax(play["off_mm"]) < 20.0
    assert play["most_deg"] == np.nanmax(play["off_deg"]) < 20.0
    held.save(tmp_path / "held")
    command = [str(tmp_path / "held"), "--robot", str(urdf), "-o", str(tmp_path / "out"), "--no-baselines", "--play"]
    assert transfer.main(command) == 0
    summary = {row["method"]: row for row in results(tmp_path / "out")["summary"]}
    assert (summary["holdfast"]["played_stays"], summary["holdfast"]["played"]) == (1, 1)
    assert summary["human hand"]["played"] == 0
    with pytest.raises(SystemExit):
        transfer.main([*command, "--no-physics"])


def test_means_over_clips_are_of_contacts_and_frames():
    row = {"frames": 10, "contacts": 2, "contact_distance_mm": 1.0, "contact_normal_deg": 5.0,
           "press_direction_deg": None, "bones": 0, "bone_direction_deg": None, "ms_per_frame": 1.0,
           "max_penetration_depth_mm": 0.5, "frames_deeper_than_2_mm": 0, "held_directions": None}
    other = {**row, "frames": 30, "contacts": 6, "contact_distance_mm": 3.0, "ms_per_frame": 3.0, "held_directions": 6}
    mean = transfer.means_of([row, other])
    assert mean["contact_distance_mm"] == 2.5 and mean["ms_per_frame"] == 2.5
    assert mean["press_direction_deg"] is None and mean["bone_direction_deg"] is None
    assert (mean["held_in_all_six"], mean["tried"], mean["frames"]) == (1, 1, 40)
    assert "| - | - |" in transfer.table({("a", "b"): mean})


def test_random_numbers_are_those_of_cpp():
    random = markers.Random(5489)
    for _ in range(9999):
        random.uniform()
    assert random.uniform() == (9981545732273789042 >> 11) * 2.0**-53  # the standard's check


def trial(residual_mm, frames):
    head = {"hand_deep_frames": 0, "hand_deep_frames_before": 0, "hand_deepest_mm": 0.0, "hand_deepest_before_mm": 0.0}
    return {"fault": "", "frames": frames, "rate_hz": 100.0, "residual": [residual_mm**2 * frames, frames],
            "worst_marker": "RFTP", "worst_marker_rms_mm": 9.0, "change": [400.0 / residual_mm, 100],
            "change_max_mm": 30.0, "gap": [0.0, 0], "left_out": {"RFTP": [9.0 * frames, frames]}, "head": head,
            "drink": None, "touches": None}


def test_sums_of_markers_are_of_all_trials_that_were_solved():
    rows = {"a": trial(1.0, 300), "c": {"fault": "no marker's name is known"}, "b": trial(3.0, 100)}
    text, sums = markers.report(rows)
    assert sums["rms_mm"] == pytest.approx(math.sqrt((300.0 + 900.0) / 400.0)) and sums["left_out_rms_mm"] == 3.0
    assert "c: no marker's name is known" in text and "2 trials solved, 0.1 minutes" in text
    assert "| marker residual | 1.7 | trial b 3.0 mm (RFTP 9.0 mm) |" in text
    assert "| outliers and a swapped pair | 1.6 | trial a 2.0 mm (up to 30 mm) |" in text and "gaps" not in text
    assert markers.report({"c": rows["c"]})[1] is None


def test_sums_of_drinks_are_of_those_who_drink():
    drink = {"rim_from_mouth_mm": 10.0, "lean_on_table_deg": 1.0, "wrist_shift_max_mm": 20.0, "skin_in_cup_mm": 0.5,
             "grasp_status": "found", "in_body_frames": 0}
    rows = {"a": {**trial(1.0, 300), "drink": drink}, "c": trial(1.0, 100),
            "b": {**trial(1.0, 200), "drink": {**drink, "rim_from_mouth_mm": 30.0, "grasp_status": "none", "in_body_frames": 3}}}
    rows["a"]["head"].update(hand_deep_frames=1, hand_deep_frames_before=7, hand_deepest_mm=3.0, hand_deepest_before_mm=20.0)
    text, _ = markers.report(rows)
    assert "rim from the mouth: 20.0 mm; 1 of 2 trials within 20 mm, worst b 30.0 mm" in text
    assert "1 grasps not clean, 3 frames deeper" in text
    assert "1 of 600 frames deeper than 2 mm, up to 3 mm; before adjustment 7, up to 20 mm" in text


def test_a_touch_of_a_pillow_is_found_and_kept(tmp_path):
    """The first of twenty-one touches of a pillow, which stays where it is."""
    data = DATA / "markers" / "dfki_pillow"
    if not data.exists():
        pytest.skip(f"no {data} (set HOLDFAST_DATA)")
    recording = holdfast.read_markers(data / "recording.tsv.gz")
    holdfast.write_markers(tmp_path / "touch.c3d", {**recording, "positions": recording["positions"][:500]})
    (tmp_path / "pillow.csv").write_text("name,x,y,z\npillow_top,0.1502,0.0760,0.0950\npillow_left,-0.1502,-0.1160,0.0950\n"
                                         "pillow_right,0.1502,-0.1143,0.0950\n")
    trials = holdfast.find_marker_trials(tmp_path)
    assert [(one["name"], one["static"], one["person"]) for one in trials] == [("touch", None, tmp_path.name)]
    command = [str(tmp_path), "--object", str(data / "pillow_small.stl"), "--object-markers",
               str(tmp_path / "pillow.csv"), "--left-out", "1", "--gap", "0.5", "--outliers", "0.02", "-o", str(tmp_path / "out")]
    assert markers.main(command) == 0
    value = results(tmp_path / "out")
    touches = value["trials"][0]["touches"]
    assert len(touches["by_markers"]) == touches["found"] == touches["kept"] == 1
    assert touches["without_marker"] == touches["frames_deeper_than_2_mm_refined"] == 0
    assert value["rms_mm"] < 3.0 < value["trials"][0]["worst_marker_rms_mm"] + 3.0
    assert 0.0 < value["gap_rms_mm"] < 30.0 and 0.0 < value["faults_change_rms_mm"] < 10.0
    assert value["trials"][0]["left_out_rms_mm"] == {}  # without a static trial nothing tells its place
    assert "touch: 1 touches" in (tmp_path / "out" / "evaluation.md").read_text()
    assert (tmp_path / "out" / "markers.csv").read_text().splitlines()[1].startswith("touch,")


def test_a_folder_without_a_trial_that_is_solved_ends_with_3(tmp_path):
    recording = {"names": ["one", "two"], "positions": np.zeros((3, 2, 3)), "rate_hz": 100.0}
    holdfast.write_markers(tmp_path / "a.c3d", recording)
    assert markers.main([str(tmp_path), "-o", str(tmp_path / "out")]) == 3
    assert "no trial was solved" in (tmp_path / "out" / "evaluation.md").read_text()


def capture(frames, deep, contact, move):
    side = dict.fromkeys(captures.COUNTS, 0)
    after = {**side, "frames_deeper_than_2_mm": deep, "max_penetration_depth_mm": 0.5 * deep,
             "hand_frames_in_contact": contact, "fingertips_beside": 4 * frames}
    return {"fault": "", "frames": frames, "seconds": frames / 30.0, "fingers_move": move, "before": side, "after": after,
            "finger_rotations_replaced": 0, "hand_frames_followed": frames, "wrist_rms_mm": 10.0 * deep, "wrist_max_mm": 1.0,
            "object_rms_mm": 0.0}


def test_sums_of_captures_are_of_all_clips_that_were_refined():
    rows = {"a": capture(100, 0, 80, False), "c": {**capture(70, 70, 0, True), "fault": "no hand"}, "b": capture(300, 4, 300, True)}
    text, sums = captures.table(rows)
    assert sums["refined"] == 2 and sums["without_moving_fingers"] == 1 and sums["all"]["frames"] == 400
    assert sums["all"]["after"]["fingertips_beside"] == 1600
    assert sums["all"]["wrist_rms_mm"] == pytest.approx(math.sqrt(0.75 * 1600.0))
    assert "c: no hand" in text and "| in contact | 0.0 | 95.0 |" in text and "| deeper than 2 mm | 0.0 | 1.0 |" in text
    assert "deepest b 2.0 mm (4 frames); least contact a 80.0 %" in text
    assert captures.table({"c": rows["c"]}) == ("c: no hand\nno clip was refined\n", None)


def test_captures_are_measured_before_and_after_and_faults_are_named(held, tmp_path):
    held.save(tmp_path / "clips" / "held")
    held.save(tmp_path / "clips" / "away")
    away = holdfast.Clip.load(tmp_path / "clips" / "away")
    away.object.trans[:, 1] += 5.0
    away.save(tmp_path / "clips" / "away" / "clip.npz", force=True)
    holdfast.Clip.load("demo_drink").save(tmp_path / "clips" / "bare.npz")  # has no object
    command = [str(tmp_path / "clips"), "-o", str(tmp_path / "out")]
    assert captures.main([*command, "--jobs", "2"]) == 0
    value = results(tmp_path / "out")
    first, second = value["clips"]
    assert first["clip"] == "away/clip.npz" and first["fault"]
    assert second["clip"] == "held/clip.npz" and not second["fault"] and second["hand_frames_followed"] == 12
    assert second["after"]["frames_deeper_than_2_mm"] == 0 and second["after"]["hand_frames_in_contact"] == 12
    assert value["refined"] == 1 and "core_s" not in second
    assert len((tmp_path / "out" / "captures.csv").read_text().splitlines()) == 3
    before = (tmp_path / "out" / "evaluation.json").read_bytes()
    store = tmp_path / "out" / "clips.jsonl"
    store.write_text("\n".join(store.read_text().split("\n")[:2]) + "\n")
    assert captures.main([*command, "--jobs", "1"]) == 0
    assert (tmp_path / "out" / "evaluation.json").read_bytes() == before
    refused(holdfast.Error, "different configuration", captures.main, [*command, "--every", "3"])
    assert captures.main([*command, "--every", "3", "--force"]) == 3


def test_a_captured_rebound_has_no_jumps_no_depth_and_the_ball_in_hand():
    path = DATA / "skillmimic/rebound/002_023pickle_rebound_6.pt"
    if not path.exists():
        pytest.skip(f"no {path} (set HOLDFAST_DATA)")
    row = captures.refine_clip({"file": str(path), "body": None, "frame_rate": 0.0})
    assert not row["fault"] and row["fingers_move"]
    assert row["before"]["frames_with_finger_jumps"] > 0 and row["after"]["frames_with_finger_jumps"] == 0
    assert row["after"]["frames_deeper_than_2_mm"] == 0 and row["hand_frames_followed"] > 10
    assert captures.contact_share(row) >= 0.95


def test_what_is_not_finite_is_no_number_of_json():
    value = {"a": [1.0, math.nan], "b": (math.inf, 2)}
    assert _study.finite(value) == {"a": [1.0, None], "b": [None, 2]}
