# SPDX-License-Identifier: MIT
"""Captured clips with their objects, before and after holdfast.refine."""

import math
import pathlib
import time

import numpy as np

import holdfast
from holdfast.evaluate import _study

WRISTS = [holdfast.JOINT_NAMES.index(f"{side}_wrist") for side in ("right", "left")]
# Counts of one side, in the order of the table's columns.
COUNTS = ["frames_with_finger_jumps", "frames_deeper_than_2_mm", "max_penetration_depth_mm",
          "hand_frames_in_contact", "fingertips_touch", "fingertips_beside", "fingertips_inside"]


def find_captures(folder, every):
    """Files that may be clips with an object (.pt, .npz, .glb) in a folder and those below it."""
    if not folder.is_dir():
        raise holdfast.Error(f"{folder}: is not a folder. Give one with clips that have an object")
    files = sorted(path for path in folder.rglob("*")
                   if path.suffix in (".pt", ".npz", ".glb") and path.is_file())
    return files[::every]


def refine_clip(task):
    """Refines a clip and measures it before and after; None for a clip without an object."""
    body = _study.body_of(task["body"])
    clip = holdfast.Clip.load(task["file"], body=body, frame_rate=task["frame_rate"])
    if clip.object is None:
        return None
    row = {"fault": "", "frames": len(clip), "seconds": len(clip) / clip.frame_rate,
           "fingers_move": False, "finger_rotations_replaced": 0, "hand_frames_followed": 0,
           "before": dict.fromkeys(COUNTS, 0), "after": dict.fromkeys(COUNTS, 0),
           "wrist_rms_mm": 0.0, "wrist_max_mm": 0.0, "object_rms_mm": 0.0}
    begin = time.process_time()
    try:
        refined = holdfast.refine(clip, body=body, threads=1)
    except (holdfast.Error, holdfast.FitFailure) as error:
        return {**row, "fault": str(error), "core_s": time.process_time() - begin}
    moved = 1e3 * np.linalg.norm(holdfast.joint_positions(refined.clip, body)[:, WRISTS]
                                 - holdfast.joint_positions(clip, body)[:, WRISTS], axis=2)
    for when, numbers in (("before", refined.before), ("after", refined.after)):
        row[when] = {key: numbers[key] for key in COUNTS}
    row.update(fingers_move=any(hand["move"] for hand in refined.fingers),
               finger_rotations_replaced=sum(hand["rotations_replaced"] for hand in refined.fingers),
               hand_frames_followed=refined.after["hand_frames_held"],
               wrist_rms_mm=math.sqrt(np.mean(moved**2)), wrist_max_mm=float(moved.max()),
               object_rms_mm=refined.distance["rms_mm"], core_s=time.process_time() - begin)
    return row


def contact_share(row):
    """Fraction of the frames in which the object follows a hand that are in contact after refining;
    1 if there are none."""
    frames = row["hand_frames_followed"]
    return row["after"]["hand_frames_in_contact"] / frames if frames else 1.0


def sums_of(rows):
    """Sums over refined clips; of depths and wrists the largest, root mean squares over frames."""
    summed = {key: sum(row[key] for row in rows)
              for key in ("frames", "seconds", "finger_rotations_replaced", "hand_frames_followed")}
    for when in ("before", "after"):
        summed[when] = {key: (max if key == "max_penetration_depth_mm" else sum)(
            row[when][key] for row in rows) for key in COUNTS}
    summed["wrist_max_mm"] = max(row["wrist_max_mm"] for row in rows)
    for key in ("wrist_rms_mm", "object_rms_mm"):
        summed[key] = math.sqrt(sum(row["frames"] * row[key]**2 for row in rows) / summed["frames"])
    return summed


def table(rows):
    """The page of all clips {name: row}, and the sums; None if no clip was refined."""
    text = "".join(f"{name}: {row['fault']}\n" for name, row in rows.items() if row["fault"])
    refined = {name: row for name, row in rows.items() if not row["fault"]}
    if not refined:
        return text + "no clip was refined\n", None
    total = sums_of(refined.values())
    flat = sum(not row["fingers_move"] for row in refined.values())
    hands = total["hand_frames_followed"]

    def line(name, key, whole=None, unit=""):
        sides = [total[when][key] for when in ("before", "after")]
        if whole is not None:
            sides = [100.0 * side / whole if whole else 0.0 for side in sides]
        return [name, *(f"{side:.1f}" for side in sides), unit]

    text += (f"{len(refined)} clips refined, {total['seconds'] / 60.0:.1f} minutes, "
             f"{total['frames']} frames; in {flat} of them no finger moves\n\n")
    followed, tips = "% of frames in which the object follows the hand", "% of fingertips in these"
    text += _study.markdown(["", "before", "after", ""], [
        line("frames with a finger's jump", COUNTS[0]),
        line("deeper than 2 mm", COUNTS[1], total["frames"], "% of frames"),
        line("deepest", COUNTS[2], None, "mm"),
        line("in contact", COUNTS[3], hands, followed),
        line("fingertips touch", COUNTS[4], 5 * hands, tips),
        line("fingertips beside it, without contact", COUNTS[5], 5 * hands, tips),
        line("fingertips inside it", COUNTS[6], 5 * hands, tips)])
    deepest = max(refined, key=lambda name: refined[name]["after"]["max_penetration_depth_mm"])
    least = min(refined, key=lambda name: contact_share(refined[name]))
    after = refined[deepest]["after"]
    text += (f"\ndeepest {deepest} {after['max_penetration_depth_mm']:.1f} mm "
             f"({after['frames_deeper_than_2_mm']} frames); least contact {least} "
             f"{100.0 * contact_share(refined[least]):.1f} %\n"
             f"{total['finger_rotations_replaced']} finger rotations replaced; wrists moved "
             f"{total['wrist_rms_mm']:.1f} mm (root mean square; up to {total['wrist_max_mm']:.0f}), "
             f"objects {total['object_rms_mm']:.1f} mm\n")
    return text, {"refined": len(refined), "without_moving_fingers": flat, "all": total}


def main(arguments):
    parser = _study.parser(
        "captures", "Refines captured clips with their objects; compares finger jumps, penetration, "
        "contact and fingertips before and after. FOLDER/captures.csv has a line for each clip.",
        "captures ../shared/data/skillmimic --every 6 -o out/captures")
    parser.add_argument("folder", nargs="?", type=pathlib.Path,
                        default=_study.data_folder("skillmimic"),
                        help="folder with clips with an object (.pt, .npz, .glb), searched "
                        "recursively (HOLDFAST_DATA/skillmimic)")
    parser.add_argument("--body", help="body model in place of the embedded one")
    parser.add_argument("--every", type=int, default=1, help="use every n-th file (1)")
    options = parser.parse_args(arguments)
    files = find_captures(options.folder, options.every)
    parts = {str(path.relative_to(options.folder)):
             {"file": str(path), "body": options.body, "frame_rate": 0.0} for path in files}
    question = [options.body and _study.contents(options.body),
                {name: _study.contents(part["file"]) for name, part in parts.items()}]
    store = _study.Store(options.output, "clips", question, options.force)
    rows = store.run(refine_clip, parts, options.jobs)
    rows = {name: row for name, row in rows.items() if row is not None}
    if not rows:
        raise holdfast.Error(f"{options.folder}: contains no clip with an object. Check the path")
    times = {"core_s": sum(row.pop("core_s") for row in rows.values())}
    text, sums = table(rows)
    if sums:
        times = {"frames a second on one core":
                 round(sums["all"]["frames"] / times["core_s"], 1), **times}
    clips = [{"clip": name, **row} for name, row in rows.items()]
    _study.write_csv(options.output / "captures.csv", clips)
    _study.finish(options.output, {**(sums or {"refined": 0}), "clips": clips}, text, times)
    return 0 if sums else 3
