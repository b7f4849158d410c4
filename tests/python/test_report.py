# SPDX-License-Identifier: MIT
import json

import pytest

import holdfast
from support import refused


def header_of(path):
    page = path.read_text()
    begin = page.index('id="report-header">') + len('id="report-header">')
    return json.loads(page[begin : page.index("</script>", begin)])


@pytest.fixture
def player(has_player):
    if not has_player:
        pytest.skip("the library was built without the player")


def test_a_clip(player, demo, tmp_path):
    path = tmp_path / "new" / "demo.html"
    holdfast.report(demo, path, title="<b>Demo</b>", contact_threshold_mm=3.0)
    page = path.read_text()
    assert page.startswith("<!doctype html>") and "<!--holdfast:" not in page
    assert "<title>&lt;b&gt;Demo&lt;/b&gt;</title>" in page
    header = header_of(path)
    assert header["holdfast_version"] == holdfast.__version__
    (clip,) = header["clips"]
    assert clip["frames"] == len(demo) and clip["has_object"]
    assert clip["contact_threshold_mm"] == 3.0


def test_a_result_brings_its_object_and_curves(player, held, tmp_path):
    holdfast.report(held, tmp_path / "held.html")
    header = header_of(tmp_path / "held.html")
    assert header["title"] == "mug, clip"
    assert header["clips"][0]["has_object"]
    assert header["clips"][0]["series"]["energy_total"] == pytest.approx(
        held.energies["energy_total"]
    )
    assert len(header["clips"][0]["series"]["contact_ratio"]) == 12


def test_several_clips_by_name(player, held, demo, tmp_path):
    holdfast.report({"twelve": held, "eight": demo}, tmp_path / "two.html")
    header = header_of(tmp_path / "two.html")
    assert [clip["name"] for clip in header["clips"]] == ["twelve", "eight"]
    assert header["title"] == "twelve and eight"
    holdfast.report(["demo_drink", held.clip], tmp_path / "list.html")
    names = [clip["name"] for clip in header_of(tmp_path / "list.html")["clips"]]
    assert names == ["demo_drink", "clip 2"]


def test_a_result_folder(player, held, tmp_path):
    held.save(tmp_path / "held")
    (tmp_path / "held" / "metrics.json").write_text(json.dumps({"per_frame": {"cost": [*range(12)]}}))
    holdfast.report(tmp_path / "held", tmp_path / "folder.html")
    (clip,) = header_of(tmp_path / "folder.html")["clips"]
    assert clip["name"] == "held" and clip["has_object"]
    assert clip["series"]["cost"] == [*range(12)]


def test_progress_is_told_and_stops(player, demo, tmp_path):
    seen = []
    path = tmp_path / "page.html"
    holdfast.report([demo, demo], path, progress=lambda *args: seen.append(args))
    assert seen == [("report", 1, 2), ("report", 2, 2)]
    refused(holdfast.Stopped, "", holdfast.report, demo, tmp_path / "not.html", progress=lambda *args: False)
    assert not (tmp_path / "not.html").exists()


def test_wrong_arguments_are_said(demo, tmp_path):
    path = tmp_path / "page.html"
    for clips in ([], {}):
        refused(ValueError, "clips: expected one clip or more", holdfast.report, clips, path)
    refused(TypeError, "clip 2: expected a Clip", holdfast.report, [demo, 3], path)
    refused(ValueError, "contact_threshold_mm", holdfast.report, demo, path, contact_threshold_mm=0.0)
    refused(TypeError, "body: expected a BodyModel", holdfast.report, demo, path, body="SMPLX.npz")
    refused(holdfast.Error, "no_such_clip", holdfast.report, "no_such_clip", path)
    assert not path.exists()


def test_score_and_render_take_results(held, tmp_path):
    values = holdfast.score(held, exact="off")["values"]
    assert values == holdfast.score(held.clip, "mug", exact="off")["values"]
    published = holdfast.score(held, exact="off", protocol="grab")
    assert published["values"]["grab_contact_ratio"] == 1.0 and "grab_depth_cm" not in values
    assert "obman_train" in published["definitions"]["grab_volume_cm3"]["definition"]
    holdfast.render(held, tmp_path / "held.png", size=(40, 30), frame=0)
    assert (tmp_path / "held.png").exists()
