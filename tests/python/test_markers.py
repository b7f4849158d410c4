# SPDX-License-Identifier: MIT
"""Labelled markers as arrays, and solved for a body."""
import os
from pathlib import Path

import numpy as np
import pytest

import holdfast

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
    with pytest.raises((TypeError, ValueError, holdfast.Error), match=text):
        holdfast.solve_markers(recording)


def test_choices_are_told():
    with pytest.raises(ValueError, match="posture"):
        holdfast.solve_markers(tiny(), posture="lying")
    with pytest.raises(ValueError, match="up"):
        holdfast.solve_markers(tiny(), up="w")
    with pytest.raises(holdfast.Error, match="nowhere"):
        holdfast.read_markers("nowhere.c3d")
