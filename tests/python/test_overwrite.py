# SPDX-License-Identifier: MIT
"""A file that exists is overwritten with force=True alone, by whatever writes files."""
import inspect

import numpy as np
import pytest

import holdfast
from box_hand import write_box_hand
from support import refused

RECORDING = {"names": ["LWRA", "RWRA"], "positions": np.zeros((3, 2, 3)), "rate_hz": 100.0}


@pytest.fixture(scope="module")
def held():
    return holdfast.fit(holdfast.Clip.load("demo_drink")[:3], "mug")


@pytest.fixture(scope="module")
def robot(held, tmp_path_factory):
    return holdfast.transfer_to_robot(held, write_box_hand(tmp_path_factory.mktemp("robot") / "boxes.urdf"))


def writers(held, robot):
    """(function, its arguments before the path, its arguments after it, file) by name."""
    converted = holdfast.convert(held.clip, to_body=holdfast.BodyModel.load())
    return {
        "Clip.save": (held.clip.save, (), {}, "clip.npz"),
        "FitResult.save": (held.save, (), {}, ""),
        "ConvertResult.save": (converted.save, (), {}, "converted.json"),
        "write_markers": (holdfast.write_markers, (), {"recording": RECORDING}, "markers.c3d"),
        "RobotTransfer.save": (robot.save, (), {}, "robot.npz"),
        "RobotTransfer.save_scene": (robot.save_scene, (), {}, "scene.xml"),
        "render": (holdfast.render, (held.clip,), {"size": (8, 8)}, "sheet.png"),
        "render numbered": (holdfast.render, (held.clip,), {"size": (8, 8)}, "no_%d.png"),
        "export": (holdfast.export, (held,), {}, "held.bvh"),
        "export meshes": (holdfast.export, (held,), {}, "mesh_%d.ply"),
        "report": (holdfast.report, (held,), {}, "page.html"),
    }


def test_every_writer_is_listed_and_has_force(held, robot):
    known = {call.__name__ for call, *_ in writers(held, robot).values()}
    owners = [holdfast, *(value for value in vars(holdfast).values() if inspect.isclass(value))]
    for owner in owners:
        for name, value in vars(owner).items():
            writes = name.startswith(("save", "write")) or name in ("render", "export", "report")
            if writes and callable(value):
                assert inspect.signature(value).parameters["force"].default is False, (owner, name)
                assert name in known, (owner, name)


def test_what_exists_is_kept_without_force(held, robot, has_player, tmp_path):
    for name, (write, before, after, file) in writers(held, robot).items():
        if name == "report" and not has_player:
            continue
        folder = tmp_path / name
        folder.mkdir()
        write(*before, folder / file, **after)
        written = sorted(path for path in folder.rglob("*") if path.is_file())
        assert written, name
        for path in written:
            path.write_bytes(b"mine")
        refused(holdfast.Error, "exists already.*force=True", write, *before, folder / file, **after)
        assert all(path.read_bytes() == b"mine" for path in written), name
        write(*before, folder / file, **after, force=True)
        assert all(path.read_bytes() != b"mine" for path in written), name


def test_one_file_of_several_is_enough(held, robot, tmp_path):
    (tmp_path / "no_1.png").write_bytes(b"mine")
    with pytest.raises(holdfast.Error, match="no_1.png: exists already"):
        holdfast.render(held.clip, tmp_path / "no_%d.png", size=(8, 8))
    (tmp_path / "object.ply").write_bytes(b"mine")
    refused(holdfast.Error, "object.ply: exists already", held.save, tmp_path)
    (tmp_path / "scene_assets").mkdir()
    refused(holdfast.Error, "scene_assets: exists already", robot.save_scene, tmp_path / "scene.xml")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["no_1.png", "object.ply", "scene_assets"]
