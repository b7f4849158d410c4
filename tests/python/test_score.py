# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import holdfast
from support import refused


def test_score_of_the_demo(demo):
    result = holdfast.score(demo, exact="off")
    values = result["values"]
    assert result["frames"] == len(demo)
    assert result["protocol"]["exact_volume"] == "off"
    assert values["penetration_max_mm"] >= 0.0
    assert set(values) <= set(result["definitions"])
    assert {hand["side"] for hand in result["hands"]} <= {"right", "left"}


def test_score_of_an_object_far_away(demo):
    clip = demo.copy()
    clip.object.trans[:] += 1.0
    values = holdfast.score(clip, "mug", exact="off")["values"]
    assert values["penetration_max_mm"] == 0.0
    assert values["contact_frames_ratio"] == 0.0


def test_score_without_object(demo):
    clip = demo.copy()
    clip = clip.with_object(None)
    result = holdfast.score(clip)
    assert result["hands"] == []
    assert any("no object" in note for note in result["notes"])


def test_score_against_a_reference(demo):
    moved = demo.copy()
    moved.trans[:, 0] += 0.01
    values = holdfast.score(moved, reference=demo, exact="off")["values"]
    assert values["mpjpe_mm"] == pytest.approx(10.0, abs=1e-6)
    assert values["mpjpe_root_aligned_mm"] == pytest.approx(0.0, abs=1e-6)
    refused(holdfast.Error, "frames", holdfast.score, demo, reference=demo[:3])
    assert holdfast.score(demo, reference=demo[:3], overlap=True, exact="off")


def test_score_per_frame(demo):
    hands = holdfast.score(demo, "mug", exact="off", per_frame=True)["hands"]
    assert all(isinstance(hand["per_frame"], dict) for hand in hands)


def test_score_does_not_depend_on_threads(demo):
    one = holdfast.score(demo, "mug", exact="off", threads=1)
    assert holdfast.score(demo, "mug", exact="off", threads=2) == one


def test_wrong_arguments_are_said(demo):
    with pytest.raises(ValueError, match="exact: expected one of 'off', 'auto', 'on', got 'yes'"):
        holdfast.score(demo, exact="yes")
    refused(ValueError, "voxel 0", holdfast.score, demo, exact="off", voxel_mm=0.0)
    refused(ValueError, "depth_threshold_mm", holdfast.score, demo, depth_threshold_mm=-1.0)
    refused(TypeError, "clip: expected a Clip", holdfast.score, 3)
    refused(holdfast.Error, "", holdfast.score, "no_such_clip")


def test_progress_is_told_and_stops(demo):
    seen = []
    holdfast.score(demo, "mug", exact="off", progress=lambda *args: seen.append(args))
    assert seen and all(done <= total for _, done, total in seen)
    refused(holdfast.Stopped, "", holdfast.score, demo, "mug", exact="off", progress=lambda *args: False)
    refused(ZeroDivisionError, "", holdfast.score, demo, "mug", exact="off", progress=lambda *args: 1 / 0)
    refused(TypeError, "progress", holdfast.score, demo, "mug", exact="off", progress=3)


def test_render(demo, tmp_path):
    sizes = {}
    for name, options in {"sheet": {"sheet": (2, 1)}, "frame": {"frame": 3}}.items():
        path = tmp_path / (name + ".png")
        holdfast.render(demo, path, size=(80, 60), camera="side", **options)
        png = path.read_bytes()
        sizes[name] = tuple(np.frombuffer(png[16:24], ">u4"))
    assert sizes["frame"] == (80, 60)
    assert sizes["sheet"][0] >= 160
    turned = tmp_path / "turned.png"
    holdfast.render(demo, turned, size=(80, 60), camera="side", frame=3, azimuth_deg=90, contact=False)
    assert turned.read_bytes() != (tmp_path / "frame.png").read_bytes()
    holdfast.render(demo, tmp_path / "no_%02d.png", size=(8, 8), every=2)
    assert len(list(tmp_path.glob("no_*.png"))) == 4
    with pytest.raises(holdfast.Error, match="no_such.*metrics.json"):
        holdfast.render(demo, tmp_path / "x.png", markers=tmp_path / "no_such")
    refused(holdfast.Error, ".png, .gif or .mp4", holdfast.render, demo, tmp_path / "x.jpg")
    refused(holdfast.Error, "frame: 8 of a clip of 8 frames", holdfast.render, demo, tmp_path / "x.png", frame=8)
    refused(ValueError, "size", holdfast.render, demo, tmp_path / "x.png", size=(0, 10))
    refused(TypeError, "size: expected two whole numbers", holdfast.render, demo, tmp_path / "x.png", size="8x8")
    refused(ValueError, "azimuth_deg", holdfast.render, demo, tmp_path / "x.png", azimuth_deg=float("nan"))
    refused(TypeError, "Did you mean 'azimuth_deg'", holdfast.render, demo, tmp_path / "x.png", azimuth=10.0)
    with pytest.raises(holdfast.Stopped):
        holdfast.render(demo, tmp_path / "x.png", size=(8, 8), progress=lambda *args: False)
    assert not (tmp_path / "x.png").exists()
