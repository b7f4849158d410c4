# SPDX-License-Identifier: MIT
"""holdfast.evaluate study: pairs of films, the page and the statistics of its answers."""
import json
import re
import shutil

import pytest

import holdfast
from holdfast.evaluate import study
from holdfast.evaluate.__main__ import main


@pytest.fixture(scope="module")
def sets(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sets")
    for label, start in (("ours", 0), ("captured", 20)):
        (folder / label).mkdir()
        for name in ("drink_1", "drink_2"):
            holdfast.Clip.load("demo_drink")[start:start + 4].save(folder / label / f"{name}.npz")
    holdfast.Clip.load("demo_drink")[:4].save(folder / "ours" / "alone.npz")
    return folder


def arguments(sets, output):
    return ["study", "--set", f"ours={sets / 'ours'}", "--set", f"captured={sets / 'captured'}", "-o", str(output),
            "--size", "32", "--jobs", "1"]


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="films need ffmpeg")
def test_films_do_not_tell_their_set_and_answers_are_counted(sets, tmp_path, capsys):
    assert main(arguments(sets, tmp_path / "out")) == 0
    key = json.loads((tmp_path / "out" / "key.json").read_text())
    assert sorted(pair["name"] for pair in key["pairs"]) == ["drink_1", "drink_2"]  # not "alone"
    page = (tmp_path / "out" / "index.html").read_text()
    shown = json.loads(re.search(r"const study = (.*);", page).group(1))
    for pair, told in zip(key["pairs"], shown["pairs"]):
        assert pair["films"] == told["films"] and "drink" in told["text"]
        for film in pair["films"]:
            assert re.fullmatch(r"films/[0-9a-f]{12}\.mp4", film) and (tmp_path / "out" / film).stat().st_size > 0
    assert "ours" not in page and "captured" not in page
    assert main(arguments(sets, tmp_path / "out")) == 0  # resumes
    assert json.loads((tmp_path / "out" / "key.json").read_text()) == key

    for person, chosen in (("a", [0, 0]), ("b", [0, 1])):
        (tmp_path / f"{person}.json").write_text(json.dumps({
            "id": key["id"], "participant": person, "answers": [{"pair": i, "chosen": chosen} for i in (1, 0)]}))
    capsys.readouterr()
    answers = [str(tmp_path / f"{person}.json") for person in "ab"]
    assert main(["study", "-o", str(tmp_path / "out"), "--read", *answers]) == 0
    assert "2 participants" in capsys.readouterr().out
    choices = json.loads((tmp_path / "out" / "evaluation.json").read_text())["choices"]
    assert [(row["chosen"], row["answers"]) for row in choices] == [(4, 4), (2, 4)]
    assert choices[0]["interval_95"][1] == pytest.approx(1.0) and choices[0]["interval_95"][0] == pytest.approx(0.51, abs=0.01)

    for text, said in (("{}", "is not a file of answers"), ("[", "is not a file of answers"),
                       (json.dumps({"id": "x", "answers": []}), "of another study"),
                       (json.dumps({"id": key["id"], "answers": [{"pair": 9, "chosen": [0, 0]}]}), "not of this study"),
                       (json.dumps({"id": key["id"], "answers": [{"pair": 0, "chosen": [0, 2]}]}), "not of this study")):
        (tmp_path / "bad.json").write_text(text)
        assert main(["study", "-o", str(tmp_path / "out"), "--read", str(tmp_path / "bad.json")]) == 1
        assert said in capsys.readouterr().err


def test_wrong_sets_are_said(sets, tmp_path, capsys):
    wrong = arguments(sets, tmp_path / "no")
    wrong[4] = f"captured={tmp_path / 'none'}"
    assert main(wrong) == 1 and "is not a folder of clips" in capsys.readouterr().err
    (tmp_path / "empty").mkdir()
    wrong[4] = f"captured={tmp_path / 'empty'}"
    assert main(wrong) == 1 and "no two folders have a clip of the same name" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["study", "--set", "ours", "-o", str(tmp_path / "no")])
    assert not (tmp_path / "no").exists()
    assert study.wilson(50, 100) == pytest.approx((0.404, 0.596), abs=1e-3)
