# SPDX-License-Identifier: MIT
"""The table of docs/data_sets.md that says what was read from a file of every set. UPDATE_DOCS=1 writes it."""
import os
from pathlib import Path

import numpy as np

import holdfast

ROOT = Path(__file__).resolve().parents[2]
FIXTURES = ROOT / "tests" / "fixtures"
PAGE = ROOT / "docs" / "data_sets.md"
BEGIN, END = "<!-- written by tests/python/test_data_sets.py -->\n", "<!-- end -->\n"
MANO = {"hand_models": [str(FIXTURES / "hand_sets" / "MANO_RIGHT.pkl")]}
RIGHT, LEFT = {"hands": "rhand"}, {"hands": "lhand"}
SETS = [
    ("GRAB", "parameters/grab/grab/s1/mug_drink_1.npz", {}),
    ("ARCTIC", "parameters/arctic/data/arctic_data/data/raw_seqs/s01/box_grab_01.smplx.npy", {}),
    ("HOT3D", "hand_sets/hot3d/mano_hand_pose_trajectory.jsonl", MANO),
    ("HO-3D", "hand_sets/ho3d/meta", {}),
    ("DexYCB", "hand_sets/dexycb/841412060263", MANO),
    ("H2O", "hand_sets/h2o/subject1/h1/0/cam4", {}),
    ("ContactPose", "hand_sets/contactpose/mug/mano_fits_15.json", MANO),
    ("OakInk", "hand_sets/oakink.pkl", {}),
    ("OakInk2", "hand_sets/oakink2.pkl", {}),
    ("OakInk2, a hand", "hand_sets/oakink2.pkl", RIGHT),
    ("TACO", "hand_sets/taco/Hand_Poses/(cut, knife, bowl)/20231027_001/left_hand.pkl", {}),
    ("GigaHands", "hand_sets/gigahands.json", LEFT),
    ("HO-Cap", "hand_sets/hocap/poses_m.npy", MANO),
    ("MANO (T, 48)", "hand_sets/mano_poses.npy", {}),
    ("OMOMO", "hand_sets/omomo.p", {}),
    ("InterMimic", "hand_sets/sub3_largetable_006.pt", {}),
    ("HIMO", "hand_sets/himo/smplx/S01T001.npz", {}),
    ("ParaHome", "hand_sets/parahome/smplx_seq/s1/smplx_pose.pkl", {}),
    ("AMASS", "parameters/amass_smplx_stageii.npz", {}),
    ("Motion-X", "parameters/motion_x.npy", {}),
    ("Kimodo (SOMA)", "hand_sets/kimodo_77.npz", {}),
    ("GVHMR", "hand_sets/gvhmr.pkl", {}),
    ("WHAM", "hand_sets/wham.pkl", {}),
    ("ROMP", "hand_sets/romp.npz", {}),
    ("EasyMocap", "hand_sets/easymocap", {}),
    ("MDM", "hand_sets/sample00_rep00_smpl_params.npy", {}),
    ("SMPLify-X", "parameters/smplifyx", {"hands": "none"}),
    ("SMPLer-X", "parameters/smplerx", {}),
]


def read(path, options):
    clip = holdfast.import_motion(FIXTURES / path, **options)
    poses = clip.poses.reshape(-1, 55, 3)
    alone = clip.model_type == "mano"
    moves = [side for side, first in (("left", 25), ("right", 40)) if np.ptp(poses[:, first:first + 15], axis=0).any()
             or len(poses) == 1 and poses[:, first:first + 15].any()]
    what = f"{moves[0]} hand" if alone else "body" + (", hands" if moves else "")
    return (f"`{path}`", what, str(len(poses)), f"{clip.frame_rate:g}", clip.object.name if clip.object else "-")


def test_the_table_of_the_page_is_what_is_read():
    lines = ["| set | file of tests/fixtures | clip of | frames | Hz | object |", "|---|---|---|---|---|---|"]
    lines += [f"| {name} | {' | '.join(read(path, options))} |" for name, path, options in SETS]
    table = "\n".join(lines) + "\n"
    page = PAGE.read_text()
    begin, end = page.index(BEGIN) + len(BEGIN), page.index(END)
    if os.environ.get("UPDATE_DOCS"):
        PAGE.write_text(page[:begin] + table + page[end:])
    else:
        assert page[begin:end] == table
