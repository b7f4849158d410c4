# SPDX-License-Identifier: MIT
"""Clips for other programs."""
import json
import struct

import numpy as np
import pytest

import holdfast
from support import refused


def test_glb_has_body_and_object(held, tmp_path):
    told = holdfast.export(held, tmp_path / "held.glb")
    content = (tmp_path / "held.glb").read_bytes()
    (length,) = struct.unpack("<I", content[12:16])
    scene = json.loads(content[20:20 + length])
    assert {"body", "mug"} <= {node.get("name") for node in scene["nodes"]}
    assert told["files"] == [tmp_path / "held.glb"] and told["object"]
    assert 0.0 <= told["surface_error_mm"] <= 0.02


def test_contacts_and_meshes_and_mujoco(held, tmp_path):
    told = holdfast.export(held, tmp_path / "contacts.npz")
    assert told["frames_in_contact"] == 12
    assert len(np.load(tmp_path / "contacts.npz").files) > 0
    told = holdfast.export(held, tmp_path / "m_%02d.ply", every=6)
    assert [path.name for path in told["files"]] == [
        "m_00.ply", "m_06.ply", "m_object_00.ply", "m_object_06.ply"]
    vertices, _ = holdfast.load_mesh(tmp_path / "m_object_06.ply")
    expected, _ = held.clip.object.surface
    assert vertices.shape == expected.shape
    told = holdfast.export(held, tmp_path / "scene.xml", density=500.0)
    assert 0.02 < told["object_mass_kg"] < 0.5 and told["hand_pieces"] > 15
    assert (tmp_path / "scene_assets").is_dir()


def test_faults_are_named(held, tmp_path):
    refused(holdfast.Error, "a.fbx", holdfast.export, held, tmp_path / "a.fbx")
    refused(holdfast.Error, "every", holdfast.export, held, tmp_path / "a.glb", every=3)
    refused(holdfast.Error, "no object", holdfast.export, "demo_drink", tmp_path / "contacts.npz")
    with pytest.raises(holdfast.Error, match="no object trajectory"):
        holdfast.export("demo_drink", tmp_path / "a.glb", object="mug")
    refused(ValueError, "density", holdfast.export, held, tmp_path / "a.xml", density=np.nan)
    assert not list(tmp_path.iterdir())
