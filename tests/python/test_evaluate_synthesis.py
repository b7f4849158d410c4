# SPDX-License-Identifier: MIT
import json
import struct

import numpy as np
import pytest

import holdfast
from holdfast.evaluate import synthesis
from support import refused, results


def write_recognizer(path, seed=1):
    """An action classifier that knows nothing, by the names of the authors' module."""
    rng = np.random.default_rng(seed)
    shapes = {"hidden2label.weight": (29, 128), "hidden2label.bias": (29,)}
    for plane in ("2_2", "2_3"):
        shapes.update({f"conv1_{plane}.weight": (1, 1, 3), f"conv1_{plane}.bias": (1,)})
        for layer, inputs in enumerate((44, 128)):
            shapes.update({f"lstm{plane}.weight_ih_l{layer}": (512, inputs),
                           f"lstm{plane}.weight_hh_l{layer}": (512, 128),
                           f"lstm{plane}.bias_ih_l{layer}": (512,), f"lstm{plane}.bias_hh_l{layer}": (512,)})
    header, data = {"__metadata__": {"format": "imos-recognizer-1", "held_out": "s10"}}, b""
    for name, shape in shapes.items():
        values = rng.uniform(-0.09, 0.09, shape).astype("<f4").tobytes()
        header[name] = {"dtype": "F32", "shape": shape, "data_offsets": [len(data), len(data) + len(values)]}
        data += values
    text = json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + data)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Clips of s1 and s10, in which a mug goes rigidly with the right wrist, and a classifier."""
    folder = tmp_path_factory.mktemp("synthesis")
    demo = holdfast.Clip.load("demo_drink")
    _, joints = holdfast.BodyModel.load()(demo.poses, demo.trans)
    track = holdfast.ObjectTrack(joints[:, 21], np.zeros((len(demo), 3)), "mug", "mug")
    for k, subject in enumerate(["s1", "s10", "s10", "s10", "s10"]):
        path = folder / "set" / subject / f"mug_drink_{k}.npz"
        path.parent.mkdir(parents=True, exist_ok=True)
        moved = holdfast.Clip(demo.poses, demo.trans, betas=demo.betas, frame_rate=demo.frame_rate, object=track,
                              holding_hand=[1] * len(demo))[4 * k:len(demo) - 4 * k]
        moved.subject, moved.action = subject, "drink" if k < 4 else "toast"
        moved.save(path)
    write_recognizer(folder / "recognizer.safetensors")
    return folder


def test_a_case_is_continued_from_its_first_key_frames(data):
    assert len(holdfast.synthesis_network()["checksum"]) >= 16
    path = str(data / "set" / "s10" / "mug_drink_1.npz")
    case = holdfast.action_case(path)
    assert isinstance(case, holdfast.ActionCase)
    assert (case.subject, case.name, case.action) == ("s10", "mug_drink_1", "drink")
    assert len(case.keys) == 15 and case.joints(case.keys).shape == (15, 22, 3)
    given = case.generate("given", stream=3)
    again = case.generate("given", stream=3)
    np.testing.assert_array_equal(given["keys"].poses, again["keys"].poses)
    np.testing.assert_array_equal(given["keys"].poses[:4], case.keys.poses[:4])
    np.testing.assert_allclose(given["keys"].object.trans, case.keys.object.trans, atol=1e-9)
    assert np.abs(given["keys"].poses - case.generate("given", stream=4)["keys"].poses).max() > 1e-4
    carried = case.generate("carried", stream=3)
    assert carried["clip"] is None
    away = np.linalg.norm(case.object_from_head(carried["keys"]) - case.object_from_head(case.keys), axis=1)
    assert away[:4].max() < 1e-9 and away[4:].max() > 1e-4
    assert case.score(case.clip)["contact_frames_ratio"] >= 0
    assert case.in_motion(case.keys).frame_rate == 30
    short = holdfast.Clip.load(path)[:10]
    short.save(data / "short.npz", force=True)
    assert holdfast.action_case(str(data / "short.npz")) is None
    refused(holdfast.Error, "nowhere", holdfast.action_case, "nowhere.npz")


def test_measures_of_one_motion():
    motion = np.zeros((15, 22, 3))
    assert synthesis.mean_joint_error(motion + [0.3, 0.4, 0.0], motion) == pytest.approx(0.5)
    # The code's AVE grows with where a motion is; the field's does not.
    assert synthesis.variance_error(motion + 1.0, motion) == 0
    spread = (45.0 - 1.0)**2 / 14  # S = 3 T = 45 of each joint
    assert synthesis.variance_error_of_code(motion + 1.0, motion) == pytest.approx(spread * 22**0.5)
    moves = motion.copy()
    moves[:, :, 0] = np.arange(15)[:, None]
    assert synthesis.variance_error(moves, motion) == pytest.approx(20.0 * 22**0.5)
    with np.errstate(all="raise"):
        reference = np.array([[0.0, 1.0 - 0.06 * t, 0.0] for t in range(15)])  # comes to 0.16 m
        assert synthesis.face_error(reference, reference) == 0
        assert synthesis.face_error(reference + [0.05, 0, 0], reference) == pytest.approx(0.05)
        assert synthesis.face_error(reference, reference + [0.0, 1.0, 0.0]) is None  # stays away
        near = np.full((15, 3), [0.0, 0.2, 0.0])
        assert synthesis.face_error(near, near) is None  # was there already


def test_measures_of_sets():
    rng = np.random.default_rng(3)
    a = rng.normal(size=(300, 6)).astype(np.float32)
    assert synthesis.frechet(a, a) == pytest.approx(0, abs=1e-9)
    assert synthesis.frechet(a + np.float32(2.0), a) == pytest.approx(6 * 4.0, rel=1e-6)
    assert synthesis.frechet(2 * a, a) == pytest.approx(np.trace(np.cov(a, rowvar=False)) +
                                                        (a.mean(0)**2).sum(), rel=1e-5)
    assert synthesis.frechet_of_code(a, a) == 0
    assert synthesis.frechet_of_code(a + np.float32(1.0), a) == pytest.approx(6.0, rel=1e-5)
    assert synthesis.frechet_of_halves(a, 1) > 0
    apart = synthesis.distances(a[:40])
    pairs = [np.linalg.norm(a[i] - a[j]) for i in range(40) for j in range(i)]
    assert synthesis.diversity(apart) == pytest.approx(np.mean(pairs), rel=1e-6)
    assert synthesis.diversity_of_code(apart, 1) == pytest.approx(np.mean(pairs), rel=0.15)
    labels = np.arange(40) % 2
    within = [np.mean([np.linalg.norm(a[i] - a[j]) for i in range(k, 40, 2) for j in range(k, i, 2)])
              for k in (0, 1)]
    assert synthesis.multimodality(apart, labels) == pytest.approx(np.mean(within), rel=1e-6)
    assert synthesis.multimodality(apart, np.arange(40)) is None
    # 20 pairs of each of two actions; the 27 that never occur count as zero.
    assert synthesis.multimodality_of_code(apart, labels, 1) == pytest.approx(2 * np.mean(within) / 29, rel=0.2)
    assert synthesis.over_repeats([1.0, 3.0]) == {
        "mean": 2.0, "interval_95": pytest.approx(1.96), "repeats": 2}
    assert synthesis.over_repeats([4.0])["interval_95"] == 0


def test_the_classifier_sees_each_motion_alone(data):
    recognizer = synthesis.Recognizer(data / "recognizer.safetensors")
    joints = np.random.default_rng(5).normal(size=(5, 15, 22, 3))
    features, labels = recognizer(joints)
    assert features.shape == (5, 128) and np.abs(features).max() <= 0.1 and len(labels) == 5
    alone, label = recognizer(joints[2:3])
    np.testing.assert_allclose(alone[0], features[2], atol=1e-7)
    assert label[0] == labels[2] and recognizer.notes["held_out"] == "s10"
    refused(holdfast.Error, "not finite", recognizer, np.full((1, 15, 22, 3), np.nan))
    (data / "bad.safetensors").write_bytes(b"\x08\0\0\0\0\0\0\0{\"a\": 1}")
    refused(holdfast.Error, "not an action classifier", synthesis.Recognizer, data / "bad.safetensors")


def run(data, *arguments):
    return synthesis.main(["--data", str(data / "set"), "--recognizer", str(data / "recognizer.safetensors"),
                           "--jobs", "1", *map(str, arguments)])


def test_both_tables_with_the_real_motion_first(data, tmp_path, capsys):
    told = ("--weights", "full=", "--weights", "full@2=", "--weights", "no-attention=", "--objects",
            "given,carried", "--repeats", 2, "--object-cases", 1, "-o", tmp_path / "out")
    assert run(data, *told) == 0
    out = results(tmp_path / "out")
    rows = out["rows"]
    assert [row["row"] for row in rows[:4]] == ["real", "clip", "still", "full"]
    assert len(rows) == 11  # three networks with two modes, and a mean of each mode
    assert out["sequences"] == [f"s10/mug_drink_{k}" for k in (1, 2, 3, 4)]
    real, clip, still, full = rows[:4]
    assert real["as_published"]["mpjpe_m"] is None and len(real["objects"]) == 11
    assert "as_published" not in clip
    assert full["label"] == "full model" and full["as_published"]["mpjpe_m"]["repeats"] == 2
    assert 0 < full["as_defined"]["mpjpe_m"]["mean"] < 1 and still["as_defined"]["mpjpe_m"]["repeats"] == 1
    # The mug goes rigidly with the wrist.
    assert clip["objects"]["jitter_acceleration_ratio"] == pytest.approx(1.0, abs=0.2)
    assert set(full["by_action"]) == {"drink", "toast"}
    mean = rows[9]
    assert mean["mean_of_seeds"] and mean["label"] == "full model, mean of 2 seeds"
    assert mean["as_defined"]["mpjpe_m"]["mean"] == pytest.approx(full["as_defined"]["mpjpe_m"]["mean"])
    assert out["order"]["given"][0] == "MPJPE: even with ablation 2: no self-attention"  # the same network
    table = (tmp_path / "out" / "evaluation.md").read_text()
    assert "| real motion | - | - | - |" in table
    assert "| IMoS | 0.03 ± 0.005 | 3.82 ± 0.004 | 0.27 ± 0.002 |" in table
    assert "## Order of the rows, objects given" in table and "## Order of the rows" in capsys.readouterr().out
    times = json.loads((tmp_path / "out" / "timing.json").read_text())
    assert times["given_full"]["seconds_median"] > 0 and "seconds_median" not in json.dumps(rows)

    # It goes on where it was, and does not mix in results of another configuration.
    motions = tmp_path / "out" / "motions.jsonl"
    lines = motions.read_text().splitlines(keepends=True)
    motions.write_text("".join(lines[:-1]))
    assert run(data, *told) == 0
    assert results(tmp_path / "out") == out
    refused(holdfast.Error, "a different configuration", run, data, *told, "--seed", 2)


def test_what_makes_no_sense_is_refused(data, tmp_path):
    def fault(words, *arguments):
        refused(holdfast.Error, words, run, data, *arguments, "-o", tmp_path / "out")

    fault("is not NAME=FILE", "--weights", "full.safetensors")
    fault("is not NAME=FILE", "--weights", "full@=full.safetensors")
    fault("is not NAME=FILE", "--weights", "a/b=full.safetensors")
    fault("the name of another row", "--weights", "real=")
    fault("recognizer.safetensors", "--weights", f"full={data / 'recognizer.safetensors'}")
    fault("no clip is of these subjects. Choose from s1, s10", "--held-out", "s7")
    refused(SystemExit, "", run, data, "--objects", "thrown", "-o", tmp_path / "out")
