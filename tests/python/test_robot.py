# SPDX-License-Identifier: MIT
import xml.etree.ElementTree

import numpy as np
import pytest

import holdfast
from box_hand import write_box_hand
from support import refused

@pytest.fixture(scope="module")
def urdf(tmp_path_factory):
    return write_box_hand(tmp_path_factory.mktemp("robot") / "boxes.urdf")


def test_robot_hand(urdf, tmp_path):
    hand = holdfast.RobotHand(urdf)
    assert hand.name == "boxes" and not hand.notes
    assert len(hand.joints) == 15 and hand.joints["bend_digit_0_1"] == (-0.1, 1.6)
    parts = dict(hand.parts)
    assert parts["thumb1"] == "digit_x_0" and parts["pinky3"] == "digit_3_2"
    for text in ("", "<robot", "<robot name='a'><link name='b'/></robot>"):
        (tmp_path / "bad.urdf").write_text(text)
        refused(holdfast.Error, "", holdfast.RobotHand, tmp_path / "bad.urdf")
    refused(holdfast.Error, "does not exist", holdfast.RobotHand, tmp_path / "none.urdf")


def rotation(wxyz):
    w, x, y, z = wxyz
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def turned(axis, angle):
    return rotation([np.cos(angle / 2), *(np.sin(angle / 2) * np.asarray(axis))])


def check_motion_v1(moved, urdf, path):
    """What readers of the schema require, and the places of all links by the URDF itself."""
    path.parent.mkdir()
    moved.save(path)
    read = dict(np.load(path))
    frames, joints = moved.joint_angles.shape
    assert (read["schema_version"], read["motion_kind"], read["coord_frame"], read["sequence_id"]) == (
        "motion_v1", "single_robot", "world", "moved")
    links, names = len(read["hand_frame_names"]), set(read["hand_frame_names"]) | set(read["ee_link_names"])
    assert len(names) == links + 1 and read["fps"] > 0
    slots = len(read["hand_contact_link_names"])
    shapes = {"robot_root_position": (frames, 3), "robot_root_wxyz": (frames, 4),
              "robot_joint_positions": (frames, joints), "ee_pose_w": (frames, 1, 7),
              "hand_frames_w": (1, frames, links, 7), "hand_finger_joints": (1, frames, joints),
              "object_body_position": (frames, 1, 3), "object_body_wxyz": (frames, 1, 4),
              "object_mesh_radius": (1,), "object_articulation": (frames,),
              "hand_object_contact_positions": (1, frames, slots, 3),
              "hand_object_contact_part_ids": (1, frames, slots), "hand_contact_active": (1, frames)}
    for name, shape in shapes.items():
        assert read[name].shape == shape, name
    for name in ("robot_root_wxyz", "object_body_wxyz"):
        assert np.abs(np.linalg.norm(read[name], axis=-1) - 1).max() < 1e-5
    assert np.abs(np.linalg.norm(read["hand_frames_w"][..., 3:], axis=-1) - 1).max() < 1e-5
    ids = read["hand_object_contact_part_ids"]
    touches = ids > 0
    assert set(np.unique(ids)) <= {0, 1} and touches.any()
    assert (read["hand_contact_active"] == touches.any(-1)).all()
    for name in ("hand_object_contact_normals", "hand_link_contact_normals"):
        assert np.abs(np.linalg.norm(read[name], axis=-1) - touches).max() < 1e-5
    between = read["hand_link_contact_positions"] - read["hand_object_contact_positions"]
    assert np.linalg.norm(between, axis=-1).max() < 0.02
    assert np.allclose(read["robot_root_position"], moved.wrist[1], atol=1e-6)

    placed = {str(read["ee_link_names"][0]): (np.eye(3), np.zeros(3))}
    angles = dict(zip(read["robot_joint_names"], read["robot_joint_positions"][-1]))
    for joint in xml.etree.ElementTree.parse(urdf).getroot().iter("joint"):
        origin = joint.find("origin")
        R, p = placed[joint.find("parent").get("link")]
        at = np.array((origin.get("xyz") or "0 0 0").split(), float) if origin is not None else np.zeros(3)
        roll, pitch, yaw = np.array(((origin.get("rpy") if origin is not None else None) or "0 0 0").split(), float)
        own = turned((0, 0, 1), yaw) @ turned((0, 1, 0), pitch) @ turned((1, 0, 0), roll)
        if joint.get("name") in angles:
            own = own @ turned(np.array(joint.find("axis").get("xyz").split(), float), angles[joint.get("name")])
        placed[joint.find("child").get("link")] = (R @ own, p + R @ at)
    world = rotation(read["robot_root_wxyz"][-1])
    for name, pose in zip(read["hand_frame_names"], read["hand_frames_w"][0, -1]):
        R, p = placed[str(name)]
        assert np.allclose(world @ p + read["robot_root_position"][-1], pose[:3], atol=1e-5)
        assert np.allclose(world @ R, rotation(pose[3:]), atol=1e-5)


def test_transfer_to_robot(held, urdf, tmp_path):
    moved = holdfast.transfer_to_robot(held, urdf)
    assert isinstance(moved, holdfast.RobotTransfer)
    frames = len(held.clip)
    assert moved.joint_angles.shape == (frames, 15)
    orient, trans = moved.wrist
    assert orient.shape == trans.shape == (frames, 3) and np.isfinite(trans).all()
    assert moved.metrics["frames_deeper_than_2_mm"] == 0
    assert moved.contacts and moved.contacts[0]["point"].shape == (1, 3)
    moved.save(tmp_path / "robot.npz")
    names = str(np.load(tmp_path / "robot.npz")["joint_names"]).split(",")
    assert len(names) == 15
    check_motion_v1(moved, urdf, tmp_path / "moved" / "motion_v1.npz")
    refused(holdfast.Error, "right hand", holdfast.transfer_to_robot, held, urdf, hand="left")
    refused(holdfast.Stopped, "", holdfast.transfer_to_robot, held, urdf, progress=lambda *_: False)
