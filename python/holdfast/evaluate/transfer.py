# SPDX-License-Identifier: MIT
"""Clips of a human hand transferred to robot hands, beside published methods."""

import math

import holdfast
from holdfast.evaluate import _study

BASELINES = {"laplacian": "Laplacian, penalties (OmniRetarget)",
             "keypoints": "keypoint IK (as with Mink)",
             "fingertip-vectors": "fingertip vectors (DexPilot)"}
DIRECTIONS = 6
PLAYED_MM, PLAYED_DEG = 20.0, 20.0  # of the object from its path, at most


def held_directions(transferred, human=False):
    """Directions of 6 in which the hand holds; None for sliding joints and without MuJoCo."""
    try:
        trial = transferred.hold_trial(human)
    except holdfast.Error as error:
        if "MuJoCo" not in str(error):
            raise
        return None
    return trial["held_directions"] if trial else None


def played(transferred):
    """Whether the object stays near its path when the clip is played in MuJoCo, and how far it strays."""
    play = transferred.play()
    stays = play["stable"] and play["most_mm"] <= PLAYED_MM and play["most_deg"] <= PLAYED_DEG
    return {"played_stays": stays, "played_most_mm": play["most_mm"], "played_most_deg": play["most_deg"]}


def transfer_clip(task):
    """A clip on every robot by every method, a row of measures each."""
    rows = []
    for path in task["robots"]:
        own = holdfast.transfer_to_robot(
            task["clip"], path, object=task["object"], object_scale=task["object_scale"],
            body=_study.body_of(task["body"]), threads=task["threads"])
        frames = len(own.joint_angles)
        methods = {"holdfast": own}
        if task["baselines"]:
            methods.update({label: own.baseline(name) for name, label in BASELINES.items()})
        for method, moved in [*methods.items(), ("human hand", None)]:
            human = moved is None
            held = held_directions(own if human else moved, human) if task["physics"] else None
            row = {"robot": own.robot.name, "method": method, "frames": frames,
                   **_study.finite(own.human_metrics if human else moved.metrics),
                   "ms_per_frame": 0.0 if human else moved.solve_ms / frames, "held_directions": held}
            if task["play"] and not human:
                row |= played(moved)
            rows.append(row)
    return rows


def means_of(rows):
    """Over the clips of one robot and method; None where nothing was measured."""
    def weighted(key, weight):
        counted = [(row[key], row[weight]) for row in rows if row[weight] > 0]
        weights = sum(count for _, count in counted)
        if not weights or any(value is None for value, _ in counted):
            return None
        return sum(value * count for value, count in counted) / weights

    frames = sum(row["frames"] for row in rows)
    tried = [row["held_directions"] for row in rows if row["held_directions"] is not None]
    return {"clips": len(rows), "frames": frames,
            "contact_distance_mm": weighted("contact_distance_mm", "contacts") or 0.0,
            "contact_normal_deg": weighted("contact_normal_deg", "contacts") or 0.0,
            "press_direction_deg": weighted("press_direction_deg", "contacts"),
            "bone_direction_deg": weighted("bone_direction_deg", "bones"),
            "bone_end_mm": weighted("bone_end_mm", "bones"),
            "max_penetration_depth_mm":
                sum(row["max_penetration_depth_mm"] for row in rows) / len(rows),
            "frames_deeper_than_2_mm_ratio":
                sum(row["frames_deeper_than_2_mm"] for row in rows) / max(1, frames),
            "ms_per_frame": weighted("ms_per_frame", "frames"),
            "held_in_all_six": tried.count(DIRECTIONS), "tried": len(tried)}


def plays_of(rows, human):
    """Clips that stay on their path, of those whose human hand holds the object in all six directions."""
    tried = [row["played_stays"] for row in rows
             if "played_stays" in row and human[row["clip"]] == DIRECTIONS]
    return {"played_stays": sum(tried), "played": len(tried)}


def degrees(value):
    return "-" if value is None or math.isnan(value) else f"{value:.1f}°"


def millimeters(value):
    return "-" if value is None or math.isnan(value) else f"{value:.2f}"


def table(means):
    rows = [[robot, method, f"{mean['contact_distance_mm']:.2f}", degrees(mean["contact_normal_deg"]),
             degrees(mean["press_direction_deg"]), degrees(mean["bone_direction_deg"]), millimeters(mean["bone_end_mm"]),
             f"{mean['max_penetration_depth_mm']:.2f}",
             f"{100.0 * mean['frames_deeper_than_2_mm_ratio']:.2f}%",
             f"{mean['held_in_all_six']}/{mean['tried']}"] for (robot, method), mean in means.items()]
    names = ["robot", "method", "contact, mm", "normals", "presses", "bones", "joints, mm", "deepest", "> 2 mm", "held"]
    if any("played" in mean for mean in means.values()):
        names.append("stays")
        for row, mean in zip(rows, means.values()):
            row.append(f"{mean['played_stays']}/{mean['played']}" if mean.get("played") else "-")
    return _study.markdown(names, rows)


def main(arguments):
    parser = _study.parser(
        "transfer", "Transfers clips to robot hands: contacts kept, penetration, and whether the "
        "hand keeps the object (MuJoCo); compared with published methods and the human hand. Use "
        "--jobs 1 to time one core.",
        "transfer held --robot hand.urdf -o out/transfer")
    parser.add_argument("clips", nargs="+",
                        help="clips with an object: result folders, files or embedded names")
    parser.add_argument("--robot", nargs="+", required=True, help="robot hands (URDF, MJCF)")
    parser.add_argument("--no-baselines", action="store_true", help="do not run the published methods")
    parser.add_argument("--no-physics", action="store_true", help="do not run trials in MuJoCo")
    parser.add_argument("--play", action="store_true",
                        help="also play each clip in MuJoCo with the robot's joints, position controllers, "
                        f"gravity and friction 0.8: the object stays within {PLAYED_MM / 10:g} cm and {PLAYED_DEG:g} degrees of "
                        "its path, counted over the clips whose human hand holds it")
    parser.add_argument("--object", help="mesh or embedded object in place of the clips' own")
    parser.add_argument("--object-scale", type=float, default=1.0,
                        help="multiplies the object's coordinates (1)")
    parser.add_argument("--body", help="body model in place of the embedded one")
    options = parser.parse_args(arguments)
    if options.play and options.no_physics:
        parser.error("--play: needs the trials that --no-physics leaves out")
    for path in options.robot:  # a file that is wrong ends in a second, not after minutes
        holdfast.RobotHand(path)
    for clip in options.clips:
        holdfast.Clip.load(clip)
    task = {"robots": options.robot, "object": options.object, "body": options.body,
            "object_scale": options.object_scale, "baselines": not options.no_baselines,
            "physics": not options.no_physics, "play": options.play}
    question = [task, *map(_study.contents, options.robot), *map(_study.contents, options.clips)]
    store = _study.Store(options.output, "transfers", question, options.force)
    threads = max(1, options.jobs // len(options.clips))
    parts = {clip: {**task, "clip": clip, "threads": threads} for clip in options.clips}
    rows = [{"clip": clip, **row} for clip, of_clip in
            store.run(transfer_clip, parts, options.jobs).items() for row in of_clip]
    keys = sorted({(row["robot"], row["method"]) for row in rows})
    means = {key: means_of([row for row in rows if (row["robot"], row["method"]) == key])
             for key in keys}
    if options.play:
        for (robot, method), mean in means.items():
            human = {row["clip"]: row["held_directions"] for row in rows
                     if (row["robot"], row["method"]) == (robot, "human hand")}
            mean |= plays_of([row for row in rows if (row["robot"], row["method"]) == (robot, method)], human)
    text = table(means)
    times = {f"{robot}, {method}, ms per frame": round(mean.pop("ms_per_frame"), 2)
             for (robot, method), mean in means.items()}
    for row in rows:
        del row["ms_per_frame"]
    summary = [{"robot": robot, "method": method, **mean} for (robot, method), mean in means.items()]
    _study.finish(options.output, {"rows": rows, "summary": summary}, text, times)
    return 0
