# SPDX-License-Identifier: MIT
"""Objects passed from hand to hand through a clip, and hand-overs found in synthetic clips."""

import numpy as np

import holdfast
from holdfast.evaluate import _study

# Synthetic clips: their objects in turn, and noise of the object's place (5 mm), its rotation (3
# degrees) and every joint (1 degree), standard deviations.
SYNTHETIC = ["apple", "sphere", "cylinder", "cube", "bottle", "banana", "mug", "camera"]
NOISE = (0.005, 0.0523599, 0.0174533)
FRAME_RATE = 30.0
TOLERANCE_S = 2.0 / 30.0  # a switch is found within this
CELL_M = 0.004  # of the object's distance grid: a hand's skin is known no better in a noisy clip

PASSED = ["apple", "bottle", "cube", "mug", "wineglass", "teapot", "bowl", "hammer"]
WRISTS = [holdfast.JOINT_NAMES.index(f"{side}_wrist") for side in ("right", "left")]
BOTH = 3  # of holding_hand


def same_within(found, truth, frames):
    """Whether there are as many frames of both, each pair at most `frames` apart."""
    return len(found) == len(truth) and all(abs(a - b) <= frames for a, b in zip(found, truth))


def find_one(seed):
    """One synthetic clip: its switches, and those found with and without the object."""
    name = SYNTHETIC[seed % len(SYNTHETIC)]
    clip, truth = holdfast.handover_clip(name, seed=seed, frame_rate=FRAME_RATE, noise=NOISE)
    held = holdfast.find_holds(clip, name, cell=CELL_M, threads=1)
    extent = sorted(np.ptp(holdfast.load_mesh(name)[0], axis=0))
    bare = clip.with_object(None)
    bare.holding_hand = None
    try:
        from_body = holdfast.find_handovers(bare, extent[1])["switches"]
    except holdfast.Error:  # no hands meet: not found
        from_body = []
    with_object = [change["frame"] for change in held["switches"]]
    without = [change["frame"] for change in from_body]
    tolerance = TOLERANCE_S * FRAME_RATE + 1e-9
    return {"object": name, "truth": list(truth), "with_object": with_object,
            "without_object": without,
            "hands_right_ratio": float(np.mean(held["holding_hand"] == clip.holding_hand)),
            "found_with_object": same_within(with_object, truth, tolerance),
            "found_without_object": same_within(without, truth, tolerance)}


def find_synthetic(folder, count, jobs, force=False):
    """Sums over `count` synthetic clips, of seeds 1 to `count`; their results stay in `folder`."""
    store = _study.Store(folder, "synthetic", [SYNTHETIC, NOISE, FRAME_RATE, CELL_M], force)
    clips = list(store.run(find_one, {str(k): k for k in range(1, count + 1)}, jobs).values())
    return {"clips": count, "found_with_object": sum(clip["found_with_object"] for clip in clips),
            "found_without_object": sum(clip["found_without_object"] for clip in clips)}


def mirror(clip):
    """The clip seen in a mirror at the world's x = 0: hands change sides, its object is dropped."""
    names = list(holdfast.JOINT_NAMES)
    other = [names.index(name.replace("left_", "\0").replace("right_", "left_").replace("\0", "right_"))
             for name in names]
    poses = np.reshape(clip.poses, (len(clip), -1, 3))[:, other] * [1.0, -1.0, -1.0]
    rest = clip.copy()
    rest.poses[:] = rest.trans[:] = 0.0
    pelvis = holdfast.joint_positions(rest[:1])[0, 0, 0]
    trans = np.array(clip.trans)
    trans[:, 0] = -trans[:, 0] - 2.0 * pelvis
    mirrored = clip.with_object(None)
    mirrored.poses[:] = poses.reshape(len(clip), -1)
    mirrored.trans[:] = trans
    bits = np.array(clip.holding_hand)
    one = (bits == 1) | (bits == 2)
    mirrored.holding_hand = np.where(one, bits ^ BOTH, bits) if len(bits) else None
    return mirrored


def acceleration_ratio(was, now, holding, carrying):
    """Mean acceleration of wrists (2, T, 3) over the clip's, in frames that not both hands hold: of
    the hand that has the object (`carrying`), or of the other."""
    before = after = 0.0
    for hand in (0, 1):
        has = (holding >> hand & 1 != 0) == carrying
        frames = (has & (holding != BOTH))[1:-1]
        bend = [np.linalg.norm(path[:-2] - 2.0 * path[1:-1] + path[2:], axis=1)[frames].sum()
                for path in (was[hand], now[hand])]
        before += bend[0]
        after += bend[1]
    return after / before if before > 0.0 else 1.0


def pass_object(task):
    """One object passed through the clip: grasps, wrists and accelerations; or the fault."""
    clip = holdfast.Clip.load(task["clip"])
    if task["mirrored"]:
        clip = mirror(clip)
    try:
        held = holdfast.fit(clip, task["object"], hand_over=True, keep_motion=task["keep_motion"],
                            seed=task["seed"], threads=task["threads"])
    except holdfast.FitFailure as failure:
        return {"fault": str(failure)}
    grasps = [change["grasp"] for change in held.switches if "grasp" in change]
    row = {"handovers": len(grasps), "clean": sum(grasp["clean"] for grasp in grasps)}
    for key in ("receiver_turned_deg", "receiver_moved_mm", "giver_turned_deg", "giver_moved_mm"):
        row[key] = max((grasp[key] for grasp in grasps), default=0.0)
    row["max_penetration_depth_mm"] = held.contact["max_penetration_depth_mm"]
    was, now = (holdfast.joint_positions(motion)[:, WRISTS].transpose(1, 0, 2)
                for motion in (clip, held.clip))
    holding = np.asarray(held.clip.holding_hand)
    row["carrying_acceleration_ratio"] = acceleration_ratio(was, now, holding, True)
    row["free_acceleration_ratio"] = acceleration_ratio(was, now, holding, False)
    return row


def mean_of(rows):
    """Rows without fault: sums of grasps, means of wrists, the worst depth and accelerations."""
    rows = [row for row in rows if "fault" not in row]
    if not rows:
        return None
    ways = {"handovers": sum, "clean": sum, "max_penetration_depth_mm": max,
            "carrying_acceleration_ratio": max, "free_acceleration_ratio": max}
    mean = lambda values: sum(value / len(rows) for value in values)  # noqa: E731
    return {key: ways.get(key, mean)([row[key] for row in rows]) for key in rows[0]}


def cells(name, row):
    if "fault" in row:
        return [name, row["fault"], *[""] * 7]
    digits = {"max_penetration_depth_mm": 2, "carrying_acceleration_ratio": 2,
              "free_acceleration_ratio": 2}
    return [name, f"{row['clean']} of {row['handovers']}",
            *(_study.fixed(row[key], digits.get(key, 1)) for key in list(row)[2:])]


def main(arguments):
    parser = _study.parser(
        "handovers", "Passes objects from hand to hand in a clip and its mirror image; reports the wrists' "
        "distance from the clip while both hands hold, penetration, and the acceleration of the "
        "wrists relative to the clip's. Then detects hand-overs in synthetic clips.",
        "handovers apple --one-way --found 4 -o out/handovers")
    parser.add_argument("objects", nargs="*", default=PASSED,
                        help=f"meshes or embedded objects ({' '.join(PASSED)})")
    parser.add_argument("--clip", default="demo_pass",
                        help="motion in which the object is passed (demo_pass)")
    parser.add_argument("--one-way", action="store_true", help="do not use the mirrored clip")
    parser.add_argument("--keep-motion", action="store_true",
                        help="do not adjust the giving arm")
    parser.add_argument("--found", type=int, default=120,
                        help="number of synthetic hand-overs to detect; 0: none (120)")
    options = parser.parse_args(arguments)
    question = [options.seed, options.keep_motion, _study.contents(options.clip),
                [_study.contents(name) for name in options.objects]]
    store = _study.Store(options.output, "passes", question, options.force)
    parts = {}
    for name in options.objects:
        for mirrored in (False,) if options.one_way else (False, True):
            parts[name + (", mirrored" if mirrored else "")] = {
                "object": name, "clip": options.clip, "mirrored": mirrored, "seed": options.seed,
                "keep_motion": options.keep_motion}
    for part in parts.values():
        part["threads"] = max(1, options.jobs // len(parts))
    rows = store.run(pass_object, parts, options.jobs)
    total = mean_of(rows.values())
    lines = [cells(name, row) for name, row in rows.items()]
    if total:
        lines.append(cells("mean (depth, ratios: most)", total))
    text = _study.markdown(["", "clean grasps", "receiver, deg", "receiver, mm", "giver, deg",
                            "giver, mm", "deepest, mm", "acceleration, carrying",
                            "acceleration, free"], lines)
    summary = dict(total or {})
    if options.found > 0:
        found = find_synthetic(options.output, options.found, options.jobs, options.force)
        text += (f"\nfound within 2 frames: {found['found_with_object']} of {options.found} from the "
                 f"object's noisy trajectory, {found['found_without_object']} from the body alone\n")
        summary["synthetic"] = found
    passes = [{"object": parts[name]["object"], "mirrored": parts[name]["mirrored"], **row}
              for name, row in rows.items()]
    _study.finish(options.output, {"passes": passes, "summary": summary}, text)
    return 0
