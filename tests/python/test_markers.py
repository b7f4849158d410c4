# SPDX-License-Identifier: MIT
"""Labeled markers as arrays, and solved for a body."""
import os
from pathlib import Path

import numpy as np
import pytest

import holdfast
from support import refused

DATA = Path(os.environ.get("HOLDFAST_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
TRIAL, STATIC = (DATA / "adl" / "ADL001" / name for name in ("ADL001DR1.csv.gz", "ADL001_static.csv.gz"))
captured = pytest.mark.skipif(not TRIAL.exists(), reason=f"no {TRIAL} (set HOLDFAST_DATA)")


def tiny(**changes):
    return {"names": ["RELB", "RWRA"], "positions": np.zeros((3, 2, 3)), "rate_hz": 100.0, **changes}


@captured
def test_arrays_give_the_same_as_the_files():
    drink = holdfast.read_markers(TRIAL)
    assert drink["positions"].shape[1:] == (len(drink["names"]), 3) and drink["rate_hz"] == 100.0
    clip, told = holdfast.solve_markers(TRIAL, static=STATIC)
    again, _ = holdfast.solve_markers(drink, static=holdfast.read_markers(STATIC))
    assert np.array_equal(clip.poses, again.poses)
    assert len(clip) == len(drink["positions"]) and told["rms_mm"] < 8.0
    assert "pelvis" in told["unmarked_joints"]


@captured
def test_a_repaired_recording_is_written_and_solved_alike(tmp_path):
    drink = holdfast.read_markers(TRIAL)
    drink["positions"][100:150, 5] = np.nan
    clip, told = holdfast.solve_markers(drink, static=STATIC)
    assert not np.isnan(told["repaired"]["positions"]).any()
    holdfast.write_markers(tmp_path / "drink.c3d", told["repaired"])
    written = holdfast.read_markers(tmp_path / "drink.c3d")
    assert written["names"] == drink["names"] and written["rate_hz"] == 100.0
    assert np.allclose(written["positions"], told["repaired"]["positions"], atol=1e-6)
    again, retold = holdfast.solve_markers(tmp_path / "drink.c3d", static=STATIC)
    # Those that were filled in lie on the body, so that less is left.
    assert len(again) == len(clip) and told["rms_mm"] - 0.5 < retold["rms_mm"] < told["rms_mm"] + 0.1
    assert not retold["outliers"] and not retold["swaps"]


@pytest.mark.parametrize("change, text", [
    ({"names": ["x" * 128, "RWRA"]}, "the label of marker 0 has 128 bytes"),
    ({"positions": np.zeros((3, 1, 3))}, r"\(T, 2, 3\)"),
])
def test_what_no_c3d_holds_is_told(tmp_path, change, text):
    refused((ValueError, holdfast.Error), text, holdfast.write_markers, tmp_path / "a.c3d", tiny(**change))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("recording, text", [
    (3, "recording: expected a file of markers"),
    ({"names": ["RELB"]}, "has no 'positions'"),
    (tiny(names=[]), "one name or more"),
    (tiny(names=["RELB"]), r"expected an array \(T, 1, 3\)"),
    (tiny(positions=np.zeros((3, 6))), r"expected an array \(T, 2, 3\)"),
    (tiny(positions=np.zeros((0, 2, 3))), r"expected an array \(T, 2, 3\)"),
    (tiny(positions="abc"), "expected numbers"),
    (tiny(positions=np.full((3, 2, 3), np.inf)), "got inf"),
    (tiny(rate_hz=0.0), "rate_hz"),
    (tiny(names=["one", "two"]), "one"),
    (tiny(positions=np.full((3, 2, 3), np.nan)), ""),
])
def test_what_is_no_recording_is_told(recording, text):
    refused((TypeError, ValueError, holdfast.Error), text, holdfast.solve_markers, recording)


def with_object(positions):
    """A recording of `positions` (T, 3, 3) of a mug's markers, and of three on the body, still."""
    body = np.tile([[0.0, 0.0, 0.3], [0.25, 0.05, 0.35], [-0.25, 0.05, 0.35]], (len(positions), 1, 1))
    names = ["STRN", "RSHO1", "LSHO1", "mug_a", "mug_b", "mug_c"]
    return {"names": names, "positions": np.concatenate([body, positions], axis=1), "rate_hz": 50.0}


PLACES = np.array([[0.04, 0.0, 0.02], [-0.04, 0.0, 0.05], [0.0, 0.045, 0.08]])


def test_an_object_with_markers_is_in_the_clip(tmp_path):
    table = tmp_path / "mug.csv"
    table.write_text("name,x,y,z\n" + "".join(f"mug_{n},{x},{y},{z}\n" for n, (x, y, z) in zip("abc", PLACES)))
    way = np.linspace(0.0, 0.1, 12)[:, None] * [1.0, 0.0, 0.5] + [0.1, -0.4, 0.2]
    recording = with_object(PLACES + way[:, None])
    clip, told = holdfast.solve_markers(recording, object="mug", object_markers=table, up="z")
    moved = np.asarray(clip.object.trans) - np.asarray(clip.object.trans)[0]
    assert clip.object.name == "mug" and np.allclose(moved, way - way[0], atol=1e-6)
    assert told["object"]["rms_mm"] < 1e-3 and "mug_a" not in told["unused_names"]
    places = {f"mug_{n}": place for n, place in zip("abc", PLACES)}
    again, _ = holdfast.solve_markers(recording, object="mug", object_markers=places, up="z")
    assert np.array_equal(clip.object.trans, again.object.trans)
    clip, _ = holdfast.solve_markers(recording, object_markers="mug_a, mug_b,mug_c", up="z")
    assert np.allclose(np.asarray(clip.object.trans)[-1] - np.asarray(clip.object.trans)[0], way[-1] - way[0], atol=1e-6)


@pytest.mark.parametrize("arguments, text", [
    ({"object": "mug"}, "object_markers"),
    ({"object_markers": 3}, "object_markers: expected a table"),
    ({"object_markers": "mug_x"}, "has no marker 'mug_x'"),
    ({"object_markers": "cup_*"}, r"matches 'cup_\*'"),
    ({"object_markers": "mug_a"}, "fewer than three of the object's markers"),
    ({"object_markers": {"mug_a": (1, 2)}}, "three numbers"),
    ({"object_markers": {"mug_a": (1, 2, float("nan"))}}, "finite positions"),
    ({"object_markers": "mug_*", "object": "mug"}, "names do not define"),
    ({"object_markers": "nowhere.csv"}, "nowhere.csv"),
])
def test_object_markers_that_do_not_do_are_told(arguments, text):
    with pytest.raises((TypeError, ValueError, holdfast.Error), match=text):
        holdfast.solve_markers(with_object(np.tile(PLACES, (4, 1, 1))), **arguments)


def test_choices_are_told():
    refused(ValueError, "posture", holdfast.solve_markers, tiny(), posture="lying")
    refused(ValueError, "up", holdfast.solve_markers, tiny(), up="w")
    refused(holdfast.Error, "nowhere", holdfast.read_markers, "nowhere.c3d")


def test_keypoints_become_a_hand():
    clip = holdfast.Clip.load("demo_drink")
    joints = holdfast.BodyModel.load()(clip.poses, clip.trans, vertex_ids=np.array([], int))[1]
    points = [joints[:, 21]]
    for first in (52, 40, 43, 49, 46):  # thumb, index, middle, ring, little finger
        base, middle, last = joints[:, first], joints[:, first + 1], joints[:, first + 2]
        points += [base, middle, last, last + 0.8 * (last - middle)]
    points = np.stack(points, axis=1)
    points[3] = np.nan
    seen = []
    hand, report = holdfast.solve_keypoints(1000 * points, up="z", progress=lambda *at: seen.append(at))
    assert report["hand"] == "right" and report["order"] == "mediapipe" and report["meters_per_unit"] == 0.001
    assert report["rms_mm"] < 6 and report["frames_without_hand"] == 1 and not report["notes"] and seen
    assert hand.model_type == "mano" and len(hand.poses) == len(clip.poses)
    refused(ValueError, "hand", holdfast.solve_keypoints, points, hand="third")
    refused(ValueError, "21", holdfast.solve_keypoints, points[:, :20])
    refused(holdfast.Error, "no_such.npy", holdfast.solve_keypoints, "no_such.npy")
