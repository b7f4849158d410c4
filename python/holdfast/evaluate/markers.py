# SPDX-License-Identifier: MIT
"""Marker recordings solved with all markers, with markers left out, gaps and wrong labels."""

import math
import pathlib
import time

import numpy as np

import holdfast
from holdfast.evaluate import _study

SWAP_S = 1.0  # for which two markers stand for each other
CARRIED_HZ = 30.0  # of clips with a cup
AT_MOUTH_MM = 20.0
# Touches of an object: a fingertip's marker this near, gaps shorter than this passed over, and skin
# this near.
MARKER_TOUCH_M, TOUCH_GAP_S, SKIN_TOUCH_MM = 0.03, 0.2, 3.0


class Random:
    """The generator mt19937_64 (Matsumoto and Nishimura 2000), as C++'s <random> has it."""

    SIZE, SHIFT, MASK = 312, 156, (1 << 64) - 1

    def __init__(self, seed):
        self.state = [seed & self.MASK]
        for k in range(1, self.SIZE):
            last = self.state[-1]
            self.state.append((6364136223846793005 * (last ^ last >> 62) + k) & self.MASK)
        self.at = self.SIZE

    def _twist(self):
        state, size = self.state, self.SIZE
        for k in range(size):
            x = state[k] & 0xFFFFFFFF80000000 | state[(k + 1) % size] & 0x7FFFFFFF
            state[k] = state[(k + self.SHIFT) % size] ^ x >> 1 ^ (0xB5026F5AA96619E9 if x & 1 else 0)
        self.at = 0

    def uniform(self):
        """[0, 1) of 53 bits."""
        if self.at == self.SIZE:
            self._twist()
        x = self.state[self.at]
        self.at += 1
        x ^= x >> 29 & 0x5555555555555555
        x ^= x << 17 & 0x71D67FFFEDA60000
        x ^= x << 37 & 0xFFF7EEE000000000
        return ((x ^ x >> 43) >> 11) * 2.0**-53

    def below(self, count):
        return int(self.uniform() * count)


def rms(errors):
    """Root mean square of [sum of squares, count]; 0 of none."""
    return math.sqrt(errors[0] / errors[1]) if errors[1] else 0.0


def add(errors):
    """[sum of squares, count] of several such."""
    errors = list(errors)
    return [sum(one[0] for one in errors), sum(one[1] for one in errors)]


class Trial:
    """One recording, solved in several ways."""

    def __init__(self, task):
        self.task = task
        self.body = _study.body_of(task["body"])
        self.recording = holdfast.read_markers(task["recording"])
        self.places = self.recording["positions"]
        self.names = [name.lower() for name in self.recording["names"]]
        self.still = holdfast.read_markers(task["static"]) if task["static"] else None
        self.random = Random(task["seed"] * 1_000_003 + task["index"])

    def solve(self, places):
        return holdfast.solve_markers({**self.recording, "positions": places}, static=self.still,
                                      object=self.task["object"], body=self.body,
                                      object_markers=self.task["object_markers"])

    def errors(self, told, name, begin=0, end=None):
        """What a solve says of a marker in frames where it was measured: [sum of mm2, count]."""
        solved = [marker["name"] for marker in told["markers"]]
        if name not in solved or name.lower() not in self.names:
            return [0.0, 0]
        scale = told["world"]["scale"]
        measured = self.places[begin:end, self.names.index(name.lower())]
        off = (measured - told["carried"][begin:end, solved.index(name)]) * scale
        off = off[~np.isnan(measured[:, 0])]
        return [1e6 * float((off**2).sum()), len(off)]

    def run(self):
        begin = time.process_time()
        clip, told = self.solve(self.places)
        row = {"core_s": time.process_time() - begin, "frames": len(self.places),
               "rate_hz": self.recording["rate_hz"], "fault": "",
               "worst_marker": told["worst_marker"]["name"],
               "worst_marker_rms_mm": told["worst_marker"]["rms_mm"], "head": told["head"]}
        self.seen = [marker["name"] for marker in told["markers"] if marker["frames_seen"]]
        row["residual"] = add(self.errors(told, name) for name in self.seen)
        row["touches"] = self.touches(clip, told) if self.task["object"] else None
        row["drink"] = self.drink(clip) if self.task["cup"] else None
        row["left_out"] = self.leave_out()
        row["gap"] = self.cut_gaps()
        row.update(self.add_faults(told))
        return row

    def leave_out(self):
        """Errors by marker, with its positions hidden from the solve."""
        left, count = {}, self.task["left_out"]
        for k in range(min(count, len(self.seen))):
            name = self.seen[(self.task["index"] * count + k) % len(self.seen)]
            places = self.places.copy()
            places[:, self.names.index(name.lower())] = np.nan
            errors = self.errors(self.solve(places)[1], name)
            if errors[1]:
                left[name] = errors
        return left

    def cut_gaps(self):
        """Errors in gaps, one in every two lengths of them, each of a marker that is drawn."""
        length = math.floor(self.task["gap_s"] * self.recording["rate_hz"] + 0.5)
        if length < 1:
            return [0.0, 0]
        places, gaps = self.places.copy(), []
        for at in range(length // 2, len(places) - length, 2 * length):
            name = self.seen[self.random.below(len(self.seen))]
            places[at:at + length, self.names.index(name.lower())] = np.nan
            gaps.append((name, at))
        if not gaps:
            return [0.0, 0]
        told = self.solve(places)[1]
        return add(self.errors(told, name, at, at + length) for name, at in gaps)

    def add_faults(self, plain):
        """How far outliers and a swapped pair move the solved markers."""
        count, frames, share = len(self.seen), len(self.places), self.task["outlier_share"]
        if count < 2 or share <= 0.0:
            return {"change": [0.0, 0], "change_max_mm": 0.0}
        draw, columns = self.random, [self.names.index(name.lower()) for name in self.seen]
        a = draw.below(count)
        b = (a + 1 + draw.below(count - 1)) % count
        length = min(frames, math.floor(SWAP_S * self.recording["rate_hz"] + 0.5))
        begin = draw.below(frames - length + 1)
        places, swapped = self.places.copy(), slice(begin, begin + length)
        places[swapped, columns[a]] = self.places[swapped, columns[b]]
        places[swapped, columns[b]] = self.places[swapped, columns[a]]
        for t in range(frames):
            for column in columns:
                if draw.uniform() >= share:
                    continue
                off = np.array([draw.uniform() - 0.5 for _ in range(3)])[::-1]
                off *= (0.05 + 0.15 * draw.uniform()) / max(np.linalg.norm(off), 1e-6)
                places[t, column] += off
        change = (self.solve(places)[1]["carried"] - plain["carried"]).reshape(-1, 3)
        return {"change": [1e6 * float((change**2).sum()), len(change)],
                "change_max_mm": 1e3 * float(np.linalg.norm(change, axis=1).max())}

    def drink(self, clip):
        """Fits a cup to the hand that drinks; None for trials without drinking."""
        try:
            held = holdfast.fit(clip.resample(CARRIED_HZ), self.task["cup"], drink=True,
                                body=self.body, seed=self.task["seed"], threads=1)
        except holdfast.Error as error:
            if "drinks" in str(error):
                return None
            raise
        return {**held.drink, "skin_in_cup_mm": held.contact["mean_max_penetration_depth_mm"],
                "in_body_frames": held.clearance["frames_deeper_than_2_mm"]}

    def touches(self, clip, told):
        """Touches of the object that fingertips' markers show, and what the solved and the refined
        hand's skin has of them."""
        frames, world = len(self.places), told["world"]
        gap = math.floor(TOUCH_GAP_S * self.recording["rate_hz"] + 0.5)
        turn = world["scale"] * np.array(world["rotation"])
        tips = [self.names.index(name.lower()) for name in told["fingertips"]
                if name.lower() in self.names]
        in_world = self.places[:, tips] @ turn.T + [0.0, 0.0, world["lift_m"]]
        in_object = np.einsum("tji,tmj->tmi", rotations(np.asarray(clip.object.orient)),
                              in_world - np.asarray(clip.object.trans)[:, None])
        distances = np.full(in_object.shape[:2], np.inf)
        seen = ~np.isnan(in_object[:, :, 0])
        distances[seen] = holdfast.SignedDistance(self.task["object"])(in_object[seen], threads=1)
        shown = intervals(distances.min(axis=1, initial=np.inf) < MARKER_TOUCH_M, gap)
        row = {"by_markers": shown, "frames": frames, "found": 0, "kept": 0, "without_marker": 0,
               "frames_deeper_than_2_mm": 0, "frames_deeper_than_2_mm_refined": 0,
               "max_penetration_depth_mm": 0.0, "max_penetration_depth_refined_mm": 0.0}
        try:
            refined = holdfast.refine(clip, self.task["object"], body=self.body, threads=1)
        except (holdfast.Error, holdfast.FitFailure):  # no hand gets to it
            return row
        before, after = (intervals(gaps < SKIN_TOUCH_MM, gap) for gaps in refined.gaps)
        row.update(found=met(shown, before), kept=met(shown, after),
                   without_marker=len(before) - met(before, shown))
        for end, numbers in (("", refined.before), ("_refined", refined.after)):
            row["frames_deeper_than_2_mm" + end] = numbers["frames_deeper_than_2_mm"]
            row[f"max_penetration_depth{end}_mm"] = numbers["max_penetration_depth_mm"]
        return row


def rotations(axis_angles):
    """Matrices (T, 3, 3) of axis-angle vectors (T, 3), radians (Rodrigues' formula)."""
    angles = np.linalg.norm(axis_angles, axis=1)[:, None, None]
    x, y, z = (axis_angles / np.maximum(angles[:, :, 0], 1e-300)).T
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    return np.eye(3) + np.sin(angles) * cross + (1.0 - np.cos(angles)) * (cross @ cross)


def intervals(near, gap):
    """[begin, end) of frames that are near, those at most `gap` apart together."""
    found = []
    for t in np.flatnonzero(near).tolist():
        if not found or t - found[-1][1] > gap:
            found.append([t, t])
        found[-1][1] = t + 1
    return found


def met(some, others):
    """How many of `some` intervals share a frame with one of the others."""
    return sum(any(a[0] < b[1] and b[0] < a[1] for b in others) for a in some)


def study_trial(task):
    try:
        return Trial(task).run()
    except (holdfast.Error, holdfast.FitFailure) as error:
        return {"fault": str(error)}


def head_text(rows):
    heads = [row["head"] for row in rows]
    most = lambda key: max((head[key] for head in heads), default=0.0)  # noqa: E731
    return (f"hand in an unmarked head: {sum(head['hand_deep_frames'] for head in heads)} of "
            f"{sum(row['frames'] for row in rows)} frames deeper than 2 mm, up to "
            f"{most('hand_deepest_mm'):.0f} mm; before adjustment "
            f"{sum(head['hand_deep_frames_before'] for head in heads)}, up to "
            f"{most('hand_deepest_before_mm'):.0f} mm\n")


def drink_text(rows):
    """Distances of cups from mouths; empty without drinking."""
    drinks = {name: row["drink"] for name, row in rows.items() if row["drink"]}
    if not drinks:
        return ""
    off = {name: drink["rim_from_mouth_mm"] for name, drink in drinks.items()}
    worst = max(reversed(off), key=off.get)  # the last of equals
    most = lambda key: max(drink[key] for drink in drinks.values())  # noqa: E731
    return (f"rim from the mouth: {sum(off.values()) / len(off):.1f} mm; "
            f"{sum(mm < AT_MOUTH_MM for mm in off.values())} of {len(off)} trials within 20 mm, worst "
            f"{worst} {off[worst]:.1f} mm\n"
            f"standing cups lean by up to {most('lean_on_table_deg'):.1f} deg, wrists differ from the "
            f"solve by up to {most('wrist_shift_max_mm'):.0f} mm\n"
            f"skin in the cup up to {most('skin_in_cup_mm'):.1f} mm (mean of a trial's frames), "
            f"{sum(drink['grasp_status'] != 'found' for drink in drinks.values())} grasps not clean, "
            f"{sum(drink['in_body_frames'] for drink in drinks.values())} frames deeper than 2 mm in "
            "the body\n")


def touch_text(name, touch):
    return (f"{name}: {len(touch['by_markers'])} touches by markers, {touch['found']} found "
            f"({touch['without_marker']} more), {touch['kept']} kept by refine; deeper than 2 mm: "
            f"{touch['frames_deeper_than_2_mm']} of {touch['frames']} frames solved (deepest "
            f"{touch['max_penetration_depth_mm']:.1f} mm), {touch['frames_deeper_than_2_mm_refined']} "
            f"refined ({touch['max_penetration_depth_refined_mm']:.1f} mm)\n")


def report(rows):
    """(text, sums) of all trials {name: row}; sums None where none was solved."""
    text = "".join(f"{name}: {row['fault']}\n" for name, row in rows.items() if row["fault"])
    text += "".join(touch_text(name, row["touches"]) for name, row in rows.items()
                    if row.get("touches"))
    solved = {name: row for name, row in rows.items() if not row["fault"]}
    if not solved:
        return text + "no trial was solved\n" + head_text([]), None
    residual, gap, change = (add(row[key] for row in solved.values())
                             for key in ("residual", "gap", "change"))
    by_marker = {}
    for row in solved.values():
        for name, errors in row["left_out"].items():
            by_marker[name] = add([by_marker.get(name, [0.0, 0]), errors])
    worst = max(solved, key=lambda name: rms(solved[name]["residual"]))
    row = solved[worst]
    lines = [["marker residual", f"{rms(residual):.1f}",
              f"trial {worst} {rms(row['residual']):.1f} mm ({row['worst_marker']} "
              f"{row['worst_marker_rms_mm']:.1f} mm)"]]
    left = add(by_marker.values())
    if by_marker:
        marker = max(sorted(by_marker), key=lambda name: rms(by_marker[name]))
        lines.append(["a marker left out", f"{rms(left):.1f}",
                      f"marker {marker} {rms(by_marker[marker]):.1f} mm"])
    if gap[1]:
        lines.append(["gaps", f"{rms(gap):.1f}", ""])
    if change[1]:
        worst = max(solved, key=lambda name: rms(solved[name]["change"]))
        row = solved[worst]
        lines.append(["outliers and a swapped pair", f"{rms(change):.1f}",
                      f"trial {worst} {rms(row['change']):.1f} mm (up to "
                      f"{row['change_max_mm']:.0f} mm)"])
    seconds = sum(row["frames"] / row["rate_hz"] for row in solved.values())
    text += f"{len(solved)} trials solved, {seconds / 60.0:.1f} minutes\n\n"
    text += _study.markdown(["", "mm, root mean square", "worst"], lines) + "\n"
    text += head_text(solved.values()) + drink_text(solved)
    return text, {"rms_mm": rms(residual), "left_out_rms_mm": rms(left), "gap_rms_mm": rms(gap),
                  "faults_change_rms_mm": rms(change)}


def entry_of(name, row):
    """A trial in evaluation.json, without its time."""
    if row["fault"]:
        return {"trial": name, "fault": row["fault"]}
    return {"trial": name, "rms_mm": rms(row["residual"]), "gap_rms_mm": rms(row["gap"]),
            "left_out_rms_mm": {marker: rms(errors) for marker, errors in row["left_out"].items()},
            "faults_change_rms_mm": rms(row["change"]), "faults_change_max_mm": row["change_max_mm"],
            **{key: row[key] for key in ("fault", "frames", "worst_marker", "worst_marker_rms_mm",
                                         "head", "drink", "touches")}}


def main(arguments):
    parser = _study.parser(
        "markers", "Solves marker recordings with all markers, with markers left out, with gaps, and "
        "with outliers and a swapped pair of labels. FOLDER/markers.csv has a line for each trial.",
        "markers recordings --every 12 --left-out 3 -o out/markers")
    parser.add_argument("folder", nargs="?", type=pathlib.Path, default=_study.data_folder("adl"),
                        help="folder of recordings, or of one folder per person, each with a "
                        "..._static... recording (HOLDFAST_DATA/adl)")
    parser.add_argument("--body", help="body model in place of the embedded one")
    parser.add_argument("--object", help="mesh of an object in all recordings; evaluates touches")
    parser.add_argument("--object-markers",
                        help="table of the object's markers: name,x,y,z in the mesh's frame, meters")
    parser.add_argument("--every", type=int, default=1, help="use every n-th trial (1)")
    parser.add_argument("--left-out", type=int, default=1,
                        help="number of markers to hold out of each trial, one at a time, rotating "
                        "between trials (1)")
    parser.add_argument("--cup", help="cup (mesh or embedded object) to fit in drinking trials; reports "
                        "the distance of its rim from the mouth")
    parser.add_argument("--gap", type=float, default=0.5, help="length of gaps, seconds; 0: no gaps (0.5)")
    parser.add_argument("--outliers", type=float, default=0.05,
                        help="fraction of positions moved by 50 to 200 mm, plus a swapped pair of "
                        "labels; 0: none (0.05)")
    options = parser.parse_args(arguments)
    if bool(options.object) != bool(options.object_markers):
        parser.error("--object and --object-markers must be given together")
    trials = holdfast.find_marker_trials(options.folder)[::options.every]
    task = {"body": options.body, "object": options.object, "cup": options.cup,
            "object_markers": options.object_markers, "left_out": options.left_out,
            "gap_s": options.gap, "outlier_share": options.outliers, "seed": options.seed}
    parts = {str(pathlib.Path(trial["recording"]).relative_to(options.folder)):
             {**task, "index": k, "recording": trial["recording"], "static": trial["static"]}
             for k, trial in enumerate(trials)}
    question = [task, *([_study.contents(path) for path in
                         (part["recording"], part["static"]) if path] for part in parts.values())]
    store = _study.Store(options.output, "trials", question, options.force)
    rows = store.run(study_trial, parts, options.jobs)
    names = [trial["name"] for trial in trials]
    if len(set(names)) == len(names):
        rows = dict(zip(names, rows.values()))
    text, sums = report(rows)
    solved = {name: row for name, row in rows.items() if not row["fault"]}
    times = {f"{name}, frames a second on one core": round(row["frames"] / row["core_s"])
             for name, row in solved.items()}
    if solved:
        times = {"frames a second on one core": round(
            sum(row["frames"] for row in solved.values())
            / sum(row["core_s"] for row in solved.values())),
            "slowest trial": min(times, key=times.get) + f" {min(times.values())}"}
    protocol = {"left_out_per_trial": options.left_out, "gap_s": options.gap,
                "outlier_share": options.outliers, "swap_s": SWAP_S}
    entries = [entry_of(*item) for item in rows.items()]
    _study.write_csv(options.output / "markers.csv", entries)
    _study.finish(options.output, {"protocol": protocol, **(sums or {}), "trials": entries}, text,
                  times)
    return 0 if sums else 3
