# SPDX-License-Identifier: MIT
import json

import numpy as np
import pytest

import holdfast
from holdfast.evaluate import _study, reach
from support import refused, results


@pytest.fixture
def small_grid(monkeypatch):
    """12 motions in place of 3,750."""
    monkeypatch.setattr(reach, "ANGLES", 1)
    monkeypatch.setattr(reach, "HEIGHTS", 1)
    monkeypatch.setattr(reach, "DISTANCES", 2)


def still(frames):
    """Joints that stand at x = their number / 10, the right wrist (21) at x = 2.1 and z = 1, on
    feet at z = 0.05."""
    joints = np.zeros((frames, 22, 3))
    joints[..., 0] = np.arange(22) / 10
    joints[..., 2] = 1.0
    joints[:, reach.FEET, 2] = 0.05
    return joints


def test_streams_of_random_numbers_are_the_librarys():
    # The published test values of SplitMix64 for 1234567, and of mt19937_64 for its usual seed.
    first = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    assert _study.uniforms(3, 1234567).tolist() == [(x >> 11) * 2.0**-53 for x in first]
    assert _study.uniforms(2, 1, 0)[0] != _study.uniforms(2, 1, 1)[0]
    assert holdfast.random_draws(5489, 10_000)[-1] == (9981545732273789042 >> 11) * 2.0**-53


def test_a_motion_is_measured():
    joints = still(31)
    here = reach.measure(joints, (2.1, 0.0, 1.0))
    assert (here["closest_m"], here["reached_frame"], here["rest_m"]) == (0.0, 0, 0.0)
    assert here["foot_skating_joints_ratio"] == here["airborne_ratio"] == here["fast_ratio"] == 0.0
    joints[10:, reach.WRIST, 1] = 0.5  # arrives at frame 10, in one step of 0.5 m
    there = reach.measure(joints, (2.1, 0.5, 1.0))
    assert there["closest_frame"] == there["reached_frame"] == 10
    assert there["speed_at_reach_m_s"] == pytest.approx(0.5 * 30)
    assert there["rest_m"] == 0.0
    assert reach.measure(joints, (2.1, 0.56, 1.0))["rest_m"] == pytest.approx(0.06)

    slides = still(5)
    slides[2:, 7, 0] += 0.01  # the left ankle, which is as low as the others, and first of them
    assert reach.measure(slides)["foot_skating_joints_ratio"] == 1 / 4
    jumps = still(4)
    jumps[1:3, reach.FEET, 2] = 0.13
    assert reach.measure(jumps)["airborne_ratio"] == 2 / 4
    assert not reach.measure(jumps)["tumbles"]
    jumps[1, reach.FEET[0], 2] = 1.01  # above the neck
    assert reach.measure(jumps)["tumbles"]
    runs = still(4)
    runs[2:, 0, 0] += 0.1  # 3 m/s
    assert reach.measure(runs)["fast_ratio"] == 1 / 3
    assert reach.measure(runs)["peak_pelvis_m_s"] == pytest.approx(3.0)
    breaks = still(9)
    breaks[6:] = np.nan
    broken = reach.measure(breaks, (2.1, 0.0, 1.0))
    assert broken["diverged"] and broken["reached_frame"] == 0
    assert reach.success([broken])["success_ratio"] == 1 and reach.success([broken])["rests_ratio"] == 0
    refused(holdfast.Error, "finite", reach.measure, np.full((2, 22, 3), np.nan))


def test_goals_are_about_the_start_as_the_paper_has_them():
    start = {"pelvis": [1.0, 2.0, 0.9], "ahead": [0.0, -1.0, 0.0]}
    cases = reach.cases_of([start] * 6, 5, "fixed")
    assert len(cases) == 3750 and {case["deadline"] for case in cases} == {240}
    goals = np.array([case["goal"] for case in cases])
    away = np.linalg.norm(goals[:, :2] - [1.0, 2.0], axis=1)
    assert sorted(set(away.round(9))) == [0.5, 1.625, 2.75, 3.875, 5.0]
    assert sorted(set(goals[:, 2].round(9))) == [0.0, 0.45, 0.9, 1.35, 1.8]
    np.testing.assert_allclose(goals[0], [1.0, 1.5, 0.0], atol=1e-12)  # straight ahead
    timed = reach.cases_of([start], 1, "adaptive")
    assert timed[0]["deadline"] == 58 and timed[4]["deadline"] == 200  # 42 frames and the way


def test_the_first_cases_lie_evenly():
    order = reach.spread_cases(6, 5)
    assert sorted(order) == list(range(3750))
    cases = reach.cases_of([{"pelvis": [0, 0, 0], "ahead": [0, -1, 0]}] * 6, 5, "fixed")
    for axis, places in (("angle", 5), ("height", 5), ("distance", 5), ("start", 6), ("sample", 5)):
        counts = np.bincount([cases[i][axis] for i in order[:60]], minlength=places)
        assert abs(counts - 60 / places).max() <= 2, axis


def test_starts_are_of_as_many_people_as_there_are():
    clips = [(f"{subject}{i}", subject, 100) for subject in "bac" for i in range(5)]
    clips.append(("d0", "d", 25))  # too short: frame 25 is its 26th
    names = {clips[i][0] for i in reach.choose_start_clips(clips)}
    assert sorted(name[0] for name in names) == list("aabbcc")
    again = clips[::-1]
    assert {again[i][0] for i in reach.choose_start_clips(again)} == names
    assert len(reach.choose_start_clips(clips, 2)) == 2
    refused(holdfast.Error, "16 are needed", reach.choose_start_clips, clips, 16)


def test_tracks_move_as_they_are_told_to():
    start = {"pelvis": [0.0, 0.0, 0.9], "ahead": [0.0, -1.0, 0.0]}
    for kind in reach.KINDS:
        goals, pushes, events = reach.draw_track(kind, start, 3, 600)
        assert (goals, pushes, events) == reach.draw_track(kind, start, 3, 600)
        assert goals != reach.draw_track(kind, start, 4, 600)[0]
        steps = np.linalg.norm(np.diff(goals, axis=0)[:, :2], axis=1) * 30
        usual = np.delete(steps, [event - 1 for event in events]) if kind == "jumps" else steps
        speed = {"turns": 1.0, "lines": usual[0]}.get(kind, 0.5)
        np.testing.assert_allclose(usual, speed, atol=1e-9)
        assert 0.2 <= speed <= 1.0
        assert events == ([150, 300, 450] if kind in ("jumps", "pushes") else [])
        assert sorted(pushes) == (events if kind == "pushes" else [])
        assert all(0.7 <= goal[2] <= 1.5 for goal in goals)


def test_motions_do_not_depend_on_their_batch():
    made = holdfast.reach_starts()
    starts = made["starts"]
    assert [start["name"] for start in starts][0] == "standing" and len(starts) == 6
    goals = [np.array(s["pelvis"]) + 0.5 * np.array(s["ahead"]) for s in starts[:2]]
    arguments = [[s["state"] for s in starts[:2]], [s["previous_delta"] for s in starts[:2]], goals,
                 [58, 58], [0, 7]]
    both = holdfast.reach_motions("intention", *arguments, frames=40)
    alone = holdfast.reach_motions("intention", *(a[1:] for a in arguments), frames=40)
    np.testing.assert_array_equal(both[1]["joints"], alone[0]["joints"])
    assert both[0]["joints"].shape == (40, 22, 3) and both[0]["states"].shape == (40, 135)
    assert abs(np.sqrt((both[0]["latents"]**2).mean()) - 1) < 0.1
    blind = holdfast.reach_motions("intention", *arguments, frames=40, with_intention=False)
    assert np.abs(blind[0]["joints"] - both[0]["joints"]).max() > 1e-3
    adam = holdfast.reach_motions("vae-opt-adam", *(a[:1] for a in arguments), frames=12)[0]
    assert len(adam["closest_m"]) == len(adam["seconds_at"]) == 201
    assert adam["solves"][0][0] == "ADAM"
    refused(ValueError, "method", holdfast.reach_motions, "legs", *arguments)
    with pytest.raises(ValueError, match="goals"):
        holdfast.reach_motions("intention", *arguments[:2], [[0, 0]] * 2, *arguments[3:])


def run(*arguments):
    assert reach.main([*map(str, arguments), "--jobs", "1"]) == 0


def test_the_protocol_goes_on_where_it_was(tmp_path, small_grid, capsys):
    told = ("--deadline", "adaptive", "--samples", 1)
    run("-o", tmp_path / "whole", *told)
    whole = results(tmp_path / "whole")
    assert [row["variant"] for row in whole["runs"]] == list(reach.VARIANTS)
    assert whole["runs"][0]["summary"]["motions"] == 12
    assert len(whole["starts"]["poses"]) == len(whole["runs"][0]["by_start"]) == 6
    table = (tmp_path / "whole" / "evaluation.md").read_text()
    assert "| full intention |" in table and "| I^w + I^r (masked) |" in table and "none captured" in table
    assert table.split("12 motions each")[1].split("\n![")[0] in capsys.readouterr().out
    full, refitted = (whole["runs"][k]["summary"] for k in (0, 1))
    assert refitted["foot_skating_ratio"] < full["foot_skating_ratio"]

    # A part that is gone is computed again, the others are read; others are not mixed in.
    motions = tmp_path / "whole" / "motions.jsonl"
    lines = motions.read_text().splitlines(keepends=True)
    motions.write_text("".join(lines[:-1]) + lines[-1][:40])
    before = {name: (tmp_path / "whole" / name).read_bytes() for name in ("evaluation.json", "evaluation.md")}
    run("-o", tmp_path / "whole", *told)
    assert before == {name: (tmp_path / "whole" / name).read_bytes() for name in before}
    refused(holdfast.Error, "a different configuration", run, "-o", tmp_path / "whole", *told, "--seed", 2)
    run("-o", tmp_path / "whole", *told, "--seed", 2, "--force", "--rows", "full,paced-half")
    variants = [row["variant"] for row in results(tmp_path / "whole")["runs"]]
    assert variants == ["full", "paced-half"]


def test_methods_side_by_side_from_captured_clips(tmp_path, small_grid):
    # Six clips of two people stand in for captures.
    demo = holdfast.Clip.load("demo_drink")
    (tmp_path / "held_out").mkdir()
    for k in range(6):
        clip = holdfast.Clip(demo.poses[:40], demo.trans[:40] + [0.1 * k, 0, 0])
        clip.subject = "ann" if k < 3 else "bob"
        clip.save(tmp_path / "held_out" / f"clip_{k}.npz")
    run("-o", tmp_path / "out", "--starts", tmp_path / "held_out", "--methods", "vae-opt-adam,intention",
        "--goals", 2, "--samples", 1, "--deadline", "adaptive")
    out = results(tmp_path / "out")
    adam, intention = out["methods"]
    assert (adam["method"], intention["method"]) == ("vae-opt-adam", "intention")
    assert len(adam["success_by_iteration"]) == 201 and len(intention["success_by_iteration"]) == 1
    assert adam["success_by_iteration"][-1] == adam["summary"]["success_ratio"]
    assert intention["summary"]["latent_rms_mean"] == pytest.approx(1.0, abs=0.05)
    assert out["captured"]["all"]["motions"] == 6 and out["starts"]["captured"]
    assert json.loads((tmp_path / "out" / "timing.json").read_text())["vae-opt-adam"]["seconds_mean"] > 0
    with pytest.raises(holdfast.Error, match="6 are needed"):
        run("-o", tmp_path / "few", "--starts", tmp_path / "held_out" / "clip_0.npz")
    refused(holdfast.Error, "contains no clip", run, "-o", tmp_path / "few", "--starts", tmp_path / "out")
    with pytest.raises(holdfast.Error, match="is not an ablation"):
        run("-o", tmp_path / "few", "--ablation-weights", "legs=other.safetensors")
    refused(SystemExit, "", run, "-o", tmp_path / "few", "--methods", "legs")


def test_goals_that_move_are_followed(tmp_path, monkeypatch):
    monkeypatch.setattr(reach, "TRACK_FRAMES", 40)
    run("-o", tmp_path / "out", "--track", "--goals", 1)
    kinds = results(tmp_path / "out")["kinds"]
    assert [kind["kind"] for kind in kinds] == reach.KINDS
    assert all(0 < kind["goal_distance_after_1_s_mean_m"] < 0.5 and kind["lowest_pelvis_m"] > 0.5
               for kind in kinds)
    assert "ms_per_frame" not in str(kinds)
