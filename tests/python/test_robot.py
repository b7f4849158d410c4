# SPDX-License-Identifier: MIT
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
    refused(holdfast.Error, "right hand", holdfast.transfer_to_robot, held, urdf, hand="left")
    refused(holdfast.Stopped, "", holdfast.transfer_to_robot, held, urdf, progress=lambda *_: False)
