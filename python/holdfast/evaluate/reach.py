# SPDX-License-Identifier: MIT
"""WANDR's protocol (Diomataris et al., CVPR 2024): measures motions to goals in all directions.

Goals lie on a cylinder about each start pose (5 angles, 5 heights, 5 distances), several samples
each: 3,750 motions of 8 s. Rows are ablations of the intention (Table 2), reaching methods
(--methods), or moving goals that are followed (--track).
"""

import functools
import math
import pathlib
import time

import numpy as np

import holdfast

from . import _study
from ._study import fixed, percent

REACHED_M, RESTS_M, SKATES_M, AIRBORNE_M = 0.10, 0.02, 0.02 / 3, 0.12
RATE, FRAMES, NECK, WRIST, FEET = 30.0, 240, 12, 21, [7, 8, 10, 11]  # feet: ankles and balls
START_FRAME, FAST_M_S = 25, 2.0
ANGLES, HEIGHTS, DISTANCES = 5, 5, 5
MAX_HEIGHT_M, NEAREST_M, FARTHEST_M = 1.8, 0.5, 5.0
BLOCK, SLOW_BLOCK = 250, 16  # motions of a part

# Table 2 of the paper: SR, DTG in meters, FS.
VARIANTS = {
    "full": ("full intention", {}, (0.32, 0.248, 0.16)),
    "refitted": ("full intention, refitted", {"refit": True}, (0.32, 0.248, 0.16)),
    "paced": ("full intention, paced", {"pace_m_s": 1.0}, (0.32, 0.248, 0.16)),
    "paced-half": ("full intention, paced, sigma 0.5", {"pace_m_s": 1.0, "sigma": 0.5}, (0.32, 0.248, 0.16)),
    "paced-refitted": ("full intention, paced, refitted", {"pace_m_s": 1.0, "refit": True}, (0.32, 0.248, 0.16)),
    "paced-half-refitted": ("full intention, paced, sigma 0.5, refitted",
                            {"pace_m_s": 1.0, "sigma": 0.5, "refit": True}, (0.32, 0.248, 0.16)),
    "wrist": ("I^w alone", {"parts": ["wrist"]}, (0.15, 0.629, 0.13)),
    "wrist+pelvis": ("I^w + I^p", {"parts": ["wrist", "pelvis"]}, (0.18, 0.449, 0.17)),
    "wrist+heading": ("I^w + I^r", {"parts": ["wrist", "heading"]}, (0.19, 0.360, 0.19)),
    "none": ("no intention", {"with_intention": False}, (None, None, None)),
}
# name: (label, method of reach_motions, its options)
METHODS = {
    "vae-opt-lbfgs-step1": ("VAE + opt: L-BFGS, step 1 (as released)", "vae-opt-lbfgs-step1", {}),
    "vae-opt-lbfgs": ("VAE + opt: L-BFGS, line search", "vae-opt-lbfgs", {}),
    "vae-opt-lm": ("VAE + opt: Levenberg-Marquardt", "vae-opt-lm", {}),
    "vae-opt-adam": ("VAE + opt: Adam", "vae-opt-adam", {}),
    "intention": ("intention", "intention", {}),
    "intention-refit": ("intention", "intention", {"refit": True}),
    "latent-opt-prior": ("latent-opt through the motion prior, not refitted", "latent-opt",
                         {"with_intention": False}),
    "latent-opt-raw": ("latent-opt, not refitted", "latent-opt", {}),
    "latent-opt": ("latent-opt (ours)", "latent-opt", {"refit": True}),
}
PAPER_METHODS = [("paper: VAE + opt", 0.03, 0.04, 2.170), ("paper: WANDR", 0.32, 0.16, 0.248)]
# What networks are told of the goal: with an adaptive deadline it is kept in mind afterwards.
DEADLINES = {"adaptive": {"min_frames_left": 10.0, "hold_last_goal": True}, "fixed": {}}
AXES = {"by_angle": "angle", "by_height": "height", "by_distance": "distance", "by_start": "start"}
KINDS = ["turns", "jumps", "pushes", "lines"]


# --- The protocol ---

def spaced(i, count, low, high):
    """Value i of `count` evenly spaced ones over [low, high]; a single one is in the middle."""
    return 0.5 * (low + high) if count == 1 else low + (high - low) * i / (count - 1)


def frames_for(distance_m, deadline):
    """Frames until a goal at a horizontal distance is due: all, or time to walk there at 0.95 m/s
    and 42 frames to start and reach."""
    if deadline == "fixed":
        return FRAMES
    return math.floor(min(max(42.0 + RATE * distance_m / 0.95, 40.0), float(FRAMES)) + 0.5)


def cases_of(starts, samples, deadline):
    """All motions by start, angle, height, distance, then sample: goals in meters, world. Angles
    are counted from the heading, counter-clockwise; the i-th case draws from stream i."""
    cases = []
    for s, start in enumerate(starts):
        pelvis, ahead = start["pelvis"], start["ahead"]
        for a in range(ANGLES):
            turn = 2.0 * math.pi * a / ANGLES
            cosine, sine = math.cos(turn), math.sin(turn)
            for h in range(HEIGHTS):
                for d in range(DISTANCES):
                    distance = spaced(d, DISTANCES, NEAREST_M, FARTHEST_M)
                    x, y = distance * ahead[0], distance * ahead[1]
                    goal = [pelvis[0] + (cosine * x - sine * y), pelvis[1] + (sine * x + cosine * y),
                            spaced(h, HEIGHTS, 0.0, MAX_HEIGHT_M)]
                    cases += [{"start": s, "angle": a, "height": h, "distance": d, "sample": k,
                               "goal": goal, "deadline": frames_for(distance, deadline)}
                              for k in range(samples)]
    return cases


def spread_cases(starts, samples):
    """Indices of all cases in an order whose first N, for any N, lie evenly on every axis of the
    grid: cells of the lattice frac(1/2 + k a), a the powers of the root of x^6 = x + 1 (Roberts
    2018), each cell when it is first met."""
    sizes = [starts, ANGLES, HEIGHTS, DISTANCES, samples]
    order, k = {}, 0
    while len(order) < math.prod(sizes):
        index, step = 0, 1.0
        for size in sizes:
            step /= 1.1347241384015194
            index = index * size + min(int(math.fmod(0.5 + k * step, 1.0) * size), size - 1)
        order.setdefault(index)
        k += 1
    return list(order)


def choose_start_clips(candidates, count=6):
    """Indices of `count` of [(name, subject, frames at 30 Hz)], of as many people as there are:
    the same for the same clips, whatever their order."""
    of_subject = {}
    for i, (_, subject, frames) in enumerate(candidates):
        if frames > START_FRAME:
            of_subject.setdefault(subject, []).append(i)
    usable = sum(map(len, of_subject.values()))
    if usable < count:
        raise holdfast.Error(f"start clips: {usable} of {len(candidates)} clips have more than "
                             f"{START_FRAME} frames at 30 fps, {count} are needed. Give more or "
                             "longer clips")

    def middle(i, of, size):
        return min(size - 1, (2 * i + 1) * size // (2 * of))

    clips = [sorted(of_subject[s], key=lambda i: candidates[i][0]) for s in sorted(of_subject)]
    share = [0] * len(clips)
    if len(clips) >= count:
        for i in range(count):
            share[middle(i, count, len(clips))] = 1
    else:
        taken = s = 0
        while taken < count:
            if share[s] < len(clips[s]):
                share[s] += 1
                taken += 1
            s = (s + 1) % len(clips)
    return [clips[s][middle(i, share[s], len(clips[s]))]
            for s in range(len(clips)) for i in range(share[s])]


# --- Measures ---

def finite_frames(joints):
    """Of joints (T, 22, 3), the frames before the first that is not finite."""
    finite = np.isfinite(joints).all((1, 2))
    return np.asarray(joints[:len(finite) if finite.all() else finite.argmin()], np.float64)


def measure(joints, goal=(0.0, 0.0, 0.0)):
    """How one motion (joints (T, 22, 3), meters, 30 Hz, ground z = 0) did on its way to a goal of
    the right wrist (docs/metrics.md, Reaching)."""
    moving = finite_frames(joints)
    frames = len(moving)
    if frames == 0:
        raise holdfast.Error("motion: it has no frame with 22 finite joints. Check its start pose")
    distance = np.linalg.norm(moving[:, WRIST] - np.asarray(goal), axis=1)
    reached = np.flatnonzero(distance <= REACHED_M)
    speed = None
    if reached.size and frames > 1:
        first = max(int(reached[0]) - 1, 0)
        speed = float(np.linalg.norm(moving[first + 1, WRIST] - moving[first, WRIST]) * RATE)
    lowest = np.array(FEET)[moving[:, FEET, 2].argmin(1)]
    at = np.arange(frames)
    way = (moving[at[1:], lowest[:-1]] - moving[at[:-1], lowest[:-1]])[:, :2]
    pelvis = np.linalg.norm(np.diff(moving[:, 0], axis=0), axis=1) * RATE
    second = moving[2:] - 2.0 * moving[1:-1] + moving[:-2]
    return {
        "closest_m": float(distance.min()),
        "closest_frame": int(distance.argmin()),
        "last_m": float(distance[-1]),
        "reached_frame": int(reached[0]) if reached.size else -1,
        "speed_at_reach_m_s": speed,
        "foot_skating_joints_ratio":
            float((np.linalg.norm(way, axis=1) > SKATES_M).sum()) / max(frames - 1, 1),
        "airborne_ratio": float((moving[at, lowest, 2] > AIRBORNE_M).sum()) / frames,
        "tumbles": bool((moving[:, FEET, 2].max(1) > moving[:, NECK, 2]).any()),
        "peak_pelvis_m_s": float(pelvis.max(initial=0.0)),
        "mean_acceleration_m_s2":
            float(np.linalg.norm(second, axis=2).mean()) * RATE**2 if frames > 2 else 0.0,
        "diverged": frames < len(joints),
        "rest_m": float(distance[max(0, frames - 1 - int(RATE) // 2):].max()),
        "fast_ratio": float((pelvis > FAST_M_S).sum()) / max(frames - 1, 1),
    }


def reached(motion):
    return motion["reached_frame"] >= 0


def manner(motions):
    """Means over motions of measures that do not depend on the goal."""
    def mean(key):
        return sum(motion[key] for motion in motions) / len(motions)

    return {
        "motions": len(motions),
        "foot_skating_ratio": mean("foot_skating_ratio"),
        "foot_skating_joints_ratio": mean("foot_skating_joints_ratio"),
        "airborne_motions_ratio": sum(m["airborne_ratio"] > 0 for m in motions) / len(motions),
        "airborne_frames_ratio": mean("airborne_ratio"),
        "tumbling_motions_ratio": mean("tumbles"),
        "pelvis_over_2_m_s_motions_ratio": sum(m["fast_ratio"] > 0 for m in motions) / len(motions),
        "pelvis_over_2_m_s_frames_ratio": mean("fast_ratio"),
        "peak_pelvis_median_m_s": float(np.median([m["peak_pelvis_m_s"] for m in motions])),
        "acceleration_mean_m_s2": mean("mean_acceleration_m_s2"),
    }


def success(motions):
    """Means over motions of measures of reaching the goal: SR, DTG and others."""
    count = len(motions)
    speeds = [m["speed_at_reach_m_s"] for m in motions if m["speed_at_reach_m_s"] is not None]
    closest = [m["closest_m"] for m in motions]
    return {
        "success_ratio": sum(map(reached, motions)) / count,
        "success_at_end_ratio":
            sum(not m["diverged"] and m["last_m"] <= REACHED_M for m in motions) / count,
        "rests_ratio": sum(not m["diverged"] and m["rest_m"] <= RESTS_M for m in motions) / count,
        "distance_to_goal_mean_m": sum(closest) / count,
        "distance_to_goal_median_m": float(np.median(closest)),
        "wrist_speed_at_reach_m_s": sum(speeds) / len(speeds) if speeds else None,
        "diverged": sum(m["diverged"] for m in motions),
    }


def by_place(cases, motions):
    """Success and distance by angle, height, distance and start of the goal."""
    labels = {"angle": lambda case: f"{360 * case['angle'] / ANGLES:.0f}°",
              "height": lambda case: f"{case['goal'][2]:.2f} m",
              "distance": lambda case:
                  f"{spaced(case['distance'], DISTANCES, NEAREST_M, FARTHEST_M):.2f} m",
              "start": lambda case: str(case["start"] + 1)}
    places = {}
    for name, axis in AXES.items():
        groups = {}
        for case, motion in zip(cases, motions):
            groups.setdefault((case[axis], labels[axis](case)), []).append(motion)
        places[name] = [{"at": label, "motions": len(group),
                         "success_ratio": sum(map(reached, group)) / len(group),
                         "distance_to_goal_mean_m": sum(m["closest_m"] for m in group) / len(group)}
                        for (_, label), group in sorted(groups.items())]
    return places


# --- What processes compute ---

def solve(part):
    """Motions of one part, measured: {"motions": [...]}, each with the seconds it took."""
    cases, starts = part["cases"], part["starts"]
    began = time.perf_counter()
    motions = holdfast.reach_motions(
        part["method"], [starts[case["start"]]["state"] for case in cases],
        [starts[case["start"]]["previous_delta"] for case in cases],
        [case["goal"] for case in cases], [case["deadline"] for case in cases], part["streams"],
        frames=FRAMES, **part["options"])
    each = (time.perf_counter() - began) / len(cases)
    return [{**measure(motion["joints"], case["goal"]),
             "foot_skating_ratio": motion["foot_skating_ratio"],
             "latent_rms": float(np.linalg.norm(motion["latents"]) / len(motion["latents"])**0.5),
             "iterates_m": [round(float(m), 6) for m in motion["closest_m"]],
             "seconds_at": [round(float(s), 4) for s in motion["seconds_at"]],
             "solves": motion["solves"],
             "seconds": float(motion["seconds_at"][-1]) if motion["seconds_at"] else each}
            for case, motion in zip(cases, motions)]


def on_mean_body(clip):
    """The same motion of the embedded body, at 30 Hz."""
    clip = clip if clip.frame_rate == RATE else clip.resample(RATE)
    return holdfast.Clip(clip.poses, clip.trans, frame_rate=RATE)


def measure_captured(path):
    walk = holdfast.walk(on_mean_body(holdfast.Clip.load(path)), skating=True)
    pelvis = walk["joints"][:, 0, :2]
    return {**measure(walk["joints"]), "foot_skating_ratio": walk["foot_skating_ratio"],
            "walks": bool((np.linalg.norm(pelvis - pelvis[0], axis=1) >= 1.0).any())}


# --- Starts, and parts of a study ---

def clip_files(paths):
    """Clips, and all clips (.npz) of folders, by name."""
    files = []
    for path in map(pathlib.Path, paths):
        found = sorted(path.glob("*.npz")) if path.is_dir() else [path]
        if not found:
            raise holdfast.Error(f"{path}: contains no clip (.npz). Give the folder of the clips")
        files += found
    return files


def chosen_clips(files):
    """[(name, Clip on the embedded body)] that motions start from."""
    clips = [holdfast.Clip.load(file) for file in files]
    moved = [on_mean_body(clip) for clip in clips]
    chosen = choose_start_clips([(file.stem, clip.subject, len(move))
                                 for file, clip, move in zip(files, clips, moved)])
    return [(files[i].stem, moved[i]) for i in chosen]


class Starts:
    """Start poses: frame 25 of captured clips, or six composed ones."""

    def __init__(self, paths):
        self.files = clip_files(paths) if paths else []
        self.clips = chosen_clips(self.files) if self.files else []
        self.names = [f"{name}, frame {START_FRAME}" for name, _ in self.clips]

    @functools.lru_cache(maxsize=None)
    def of(self, weights):
        """(starts as this network has them, what the network is)"""
        made = holdfast.reach_starts([clip for _, clip in self.clips] if self.clips else None,
                                     weights=weights)
        self.names = self.names or [start["name"] for start in made["starts"]]
        return made["starts"], made["network"]

    def note(self):
        names = "; ".join(self.names)
        return (f"Start poses: held-out captured motion ({names})." if self.files else
                f"Start poses: six of Holdfast's own, none captured ({names}).")


def parts_of(name, block, method, options, starts, cases, indices):
    """{part: argument of solve}, blocks of the cases `indices`."""
    parts = {}
    for first in range(0, len(indices), block):
        some = indices[first:first + block]
        parts[f"{name}_{first:05d}-{first + len(some):05d}"] = {
            "method": method, "options": options, "starts": starts,
            "cases": [cases[i] for i in some], "streams": some}
    return parts


def run(options, starts, plan):
    """All motions of the rows of `plan` [(row, parts)], and the captured ones, from one store."""
    store = _study.Store(options.output, "motions",
                         {"study": "reach", "measures": sorted(measure(np.zeros((3, 22, 3)))),
                          "starts": starts.of(options.weights)[0],
                          "network": starts.of(options.weights)[1]["checksum"],
                          "samples": options.samples, "sigma": options.sigma, "seed": options.seed},
                         options.force)
    everything = {name: part for _, parts in plan for name, part in parts.items()}
    results = store.run(solve, everything, options.jobs)
    for row, parts in plan:
        row["motions"] = [motion for name in parts for motion in results[name]]
    captured = store.run(measure_captured, {f"captured_{_study.checksum(file)}": str(file)
                                            for file in starts.files}, options.jobs)
    return list(captured.values())


def common_kwargs(options, weights, deadline):
    return {"weights": weights, "sigma": options.sigma, "seed": options.seed, "threads": 1,
            **DEADLINES[deadline]}


def notes_of(protocol, starts, measures):
    return ["Protocol of WANDR (Diomataris et al., CVPR 2024): " + protocol, starts.note(),
            "SR: the right wrist is within 10 cm of the goal in any frame (at end: in the last). "
            "DTG: its closest distance to the goal. FS: fraction of frames in which the lowest vertex "
            "of the body's surface moves horizontally by more than 2/3 cm to the next frame; by "
            "joints: the same for the lowest of ankles and balls of the feet. " + measures]


def results_of(schema, options, starts, notes):
    results = _study.head(schema, options.seed)
    results["network"] = starts.of(options.weights)[1]
    results["starts"] = {"captured": bool(starts.files), "poses": starts.names}
    results["notes"] = notes
    return results


def write(options, results, times, title, notes, table, figures):
    _study.write_json(options.output / "evaluation.json", results)
    _study.write_json(options.output / "timing.json", times)
    page = [f"# {title}\n", *(note + "\n" for note in notes), table, *filter(None, figures)]
    _study.write_atomically(options.output / "evaluation.md", "\n".join(page))
    print(table)


# --- Figures ---

def draw_places(rows):
    """Bars of success by height, angle, distance and start: [(label, cases, motions)]."""
    titles = {"by_height": "by height of the goal", "by_distance": "by distance",
              "by_angle": "by angle, counter-clockwise from ahead", "by_start": "by start pose"}

    def draw(axes):
        for ax, (key, title) in zip(axes, titles.items()):
            for k, (label, cases, motions) in enumerate(rows):
                places = by_place(cases, motions)[key]
                at = np.arange(len(places)) + (k - 0.5 * (len(rows) - 1)) * 0.8 / len(rows)
                ax.bar(at, [100 * place["success_ratio"] for place in places], 0.8 / len(rows),
                       label=label)
                ax.set_xticks(range(len(places)), [place["at"] for place in places])
            ax.set(title=title, ylabel="% of motions", ylim=(0, 100))
        axes[0].legend(fontsize="x-small")
    return draw


def draw_curves(curves, title, x_label, logarithmic=False, limit=None):
    """Lines of shares over a quantity: [(label, x, share)]; a single point is a level."""
    def draw(ax):
        last = max(max(x) for _, x, _ in curves)
        for label, x, share in curves:
            ax.plot([*x, last], 100 * np.array([*share, share[-1]]), label=label,
                    linestyle="--" if len(x) < 2 else "-", drawstyle="steps-post")
        if limit is not None:
            ax.axvline(limit, color="gray", linestyle=":")
        ax.set(title=title, xlabel=x_label, ylabel="% of motions", ylim=(0, 100))
        if logarithmic:
            ax.set_xscale("log")
        ax.legend(fontsize="x-small")
    return draw


def tolerance(label, motions):
    """Share of motions that come within 0 to 1 m of the goal."""
    x = np.arange(101) / 100
    closest = np.sort([motion["closest_m"] for motion in motions])
    return label, x, np.searchsorted(closest, x, side="right") / len(closest)


def draw_above(label, cases, motions):
    """Success at every place of the ground, over heights, starts and samples; ahead is up."""
    def draw(ax):
        groups = {}
        for case, motion in zip(cases, motions):
            groups.setdefault((case["angle"], case["distance"]), []).append(reached(motion))
        for (angle, distance), hits in groups.items():
            away, turn = spaced(distance, DISTANCES, NEAREST_M, FARTHEST_M), 2 * math.pi * angle / ANGLES
            x, y, share = -away * math.sin(turn), away * math.cos(turn), np.mean(hits)
            ax.scatter(x, y, 500, [[0.18, 0.44, 0.62, share]])
            ax.text(x, y, f"{100 * share:.0f}", ha="center", va="center")
        ax.set(title=f"Success from above, {label} deadline, %", xlabel="m", ylabel="m", aspect="equal")
    return draw


# --- Ablations ---

HEADS = ["intention", "SR", "SR at end", "rests", "DTG mean", "DTG median", "FS", "FS, joints",
         "airborne", "tumbles", "pelvis, peak", "acceleration", "paper: SR", "paper: DTG", "paper: FS"]


def ablation_row(row):
    s = row["summary"]
    paper = VARIANTS[row["variant"]][2]
    return [row["label"] + (f" ({row['how']})" if row["how"] else ""),
            percent(s["success_ratio"]), percent(s["success_at_end_ratio"]), percent(s["rests_ratio"]),
            fixed(100 * s["distance_to_goal_mean_m"], 1, "cm"),
            fixed(100 * s["distance_to_goal_median_m"], 1, "cm"), percent(s["foot_skating_ratio"]),
            percent(s["foot_skating_joints_ratio"]), percent(s["airborne_ratio"]),
            percent(s["tumbling_motions_ratio"]), fixed(s["peak_pelvis_median_m_s"], 2, "m/s"),
            fixed(s["acceleration_mean_m_s2"], 2, "m/s2"),
            *("-" if value is None else fixed(100 * value, digits, unit)
              for value, digits, unit in zip(paper, (0, 1, 0), ("%", "cm", "%")))]


def captured_text(captured):
    """FS of captured motion in words, and the numbers."""
    if not captured:
        return "", None
    def skating(motions):
        return [sum(m[key] for m in motions) / max(len(motions), 1)
                for key in ("foot_skating_ratio", "foot_skating_joints_ratio")]
    walking = [motion for motion in captured if motion["walks"]]
    surface, joints = skating(captured)
    text = (f"The same measure on {len(captured)} held-out captured clips: FS {percent(surface)} "
            f"(foot joints {percent(joints)})")
    if walking:
        text += (f"; on the {len(walking)} that move a meter or more: {percent(skating(walking)[0])} "
                 f"(foot joints {percent(skating(walking)[1])})")
    numbers = {"clips": len(captured), "foot_skating_ratio": surface,
               "foot_skating_joints_ratio": joints, "walking_clips": len(walking),
               "walking_foot_skating_ratio": skating(walking)[0],
               "walking_foot_skating_joints_ratio": skating(walking)[1]}
    return text + ".\n", numbers


def own_networks(told):
    networks = {}
    for text in told:
        name, equals, file = text.partition("=")
        if not equals or name not in VARIANTS or name in ("full", "refitted"):
            raise holdfast.Error(f"--ablation-weights {text}: is not an ablation. Give NAME=FILE "
                                 "with NAME wrist, wrist+pelvis, wrist+heading or none")
        networks[name] = file
    return networks


def ablations(options):
    starts, own = Starts(options.starts), own_networks(options.ablation_weights)
    plan = []
    for deadline in DEADLINES if options.deadline == "both" else [options.deadline]:
        for key, (label, kwargs, _) in VARIANTS.items():
            if key not in options.rows:
                continue
            weights = own.get(key, options.weights)
            here, network = starts.of(weights)
            cases = cases_of(here, options.samples, deadline)
            masked = key in ("wrist", "wrist+pelvis", "wrist+heading")
            how = pathlib.Path(weights).name if key in own else "masked" if masked else ""
            name = f"{deadline}_{key}" + (f"_{network['checksum'][:12]}" if key in own else "")
            plan.append(({"variant": key, "deadline": deadline, "how": how, "label": label,
                          "cases": cases},
                         parts_of(name, BLOCK, "intention",
                                  {**common_kwargs(options, weights, deadline), **kwargs}, here,
                                  cases, list(range(len(cases))))))
    captured = run(options, starts, plan)
    rows = [row for row, _ in plan]
    text, numbers = captured_text(captured)
    notes = notes_of(
        f"5 angles, 5 heights of 0 to 1.8 m and 5 distances of 0.5 to 5 m about "
        f"{len(starts.names)} start poses, {options.samples} sample{'s' * (options.samples > 1)} "
        f"each, 8 s at 30 fps; network {starts.of(options.weights)[1]['weights']}.", starts,
        "Airborne: all ankles and balls of the feet are above 12 cm. Tumbles: motions in which a foot "
        "is higher than the neck in some frame.")
    notes += [
        "Fixed deadline: the goal is due after 8 s, as in the paper. Adaptive: after 42 frames plus "
        "the time to walk there at 0.95 m/s, 40 to 240 frames; afterwards the goal stays active with "
        "10 frames left.",
        "Paced: a deadline later than walking to the goal at 1 m/s takes is told as that one, so that "
        "the person walks there and waits. Sigma: standard deviation of the latents.",
        "Refitted: the output of 'reach'. Planted feet are pinned, hands stay above the floor, and "
        "the wrist is placed at the goal where the arm reaches it from where the body stands; SR is "
        "measured on the result."]
    if any(row["how"] == "masked" for row in rows):
        notes.append("Rows marked 'masked' mask parts of the intention of one trained network at run "
                     "time; the paper trained a network for each row.")
    results = results_of("holdfast/evaluate-reach/1", options, starts, notes)
    results["runs"] = []
    tables = []
    for row in rows:
        summary = {**success(row["motions"]), **manner(row["motions"])}
        summary["airborne_ratio"] = summary["airborne_frames_ratio"]
        row["summary"] = summary
        results["runs"].append({"variant": row["variant"], "deadline": row["deadline"],
                                "how": row["how"], "summary": summary,
                                **by_place(row["cases"], row["motions"]),
                                "paper": dict(zip(("success_ratio", "distance_to_goal_mean_m",
                                                   "foot_skating_ratio"), VARIANTS[row["variant"]][2]))})
    if numbers:
        results["captured"] = numbers
    full = [row for row in rows if row["variant"] == "full"]
    figures = [_study.figure(options.output / "place.png",
                             draw_places([(f"{row['deadline']} deadline", row["cases"], row["motions"])
                                          for row in full]), 2, 2)]
    figures += [_study.figure(options.output / f"above_{row['deadline']}.png",
                              draw_above(row["deadline"], row["cases"], row["motions"]), size=(5, 5))
                for row in full]
    for deadline in DEADLINES:
        some = [row for row in rows if row["deadline"] == deadline]
        if some:
            tables.append(f"{deadline} deadline, {len(some[0]['motions'])} motions each\n\n" +
                          _study.markdown(HEADS, map(ablation_row, some)))
            figures.append(_study.figure(
                options.output / f"tolerance_{deadline}.png",
                draw_curves([tolerance(row["label"], row["motions"]) for row in some],
                            f"Success by tolerance, {deadline} deadline", "m", limit=REACHED_M)))
    seconds = {f"{row['deadline']}_{row['variant']}":
               sum(m["seconds"] for m in row["motions"]) / len(row["motions"]) for row in rows}
    write(options, results, {"seconds_per_motion": seconds}, "Reaching, by WANDR's protocol", notes,
          "\n".join(tables + ([text] if text else [])), figures)


# --- Methods ---

METHOD_HEADS = ["", "SR", "SR at end", "rests", "DTG mean", "DTG median", "FS", "FS, joints",
                "both feet > 12 cm: motions", "both feet > 12 cm: frames", "tumbles",
                "pelvis > 2 m/s: motions", "pelvis > 2 m/s: frames", "acceleration", "latents, rms"]


def manner_cells(s):
    return [percent(s["foot_skating_ratio"]), percent(s["foot_skating_joints_ratio"]),
            percent(s["airborne_motions_ratio"]), percent(s["airborne_frames_ratio"], 2),
            percent(s["tumbling_motions_ratio"]), percent(s["pelvis_over_2_m_s_motions_ratio"]),
            percent(s["pelvis_over_2_m_s_frames_ratio"], 2),
            fixed(s["acceleration_mean_m_s2"], 2, "m/s2")]


def success_by_iteration(motions):
    """Share within 10 cm after k iterations; a motion that has stopped keeps its last iterate."""
    longest = max([1, *(len(motion["iterates_m"]) for motion in motions)])
    shares = []
    for k in range(longest):
        hits = [reached(m) if not m["iterates_m"] else
                m["iterates_m"][min(k, len(m["iterates_m"]) - 1)] <= REACHED_M for m in motions]
        shares.append(sum(hits) / len(motions))
    return shares


def success_by_seconds(motions):
    """(seconds of one core per motion, share within 10 cm by then)"""
    iterate = [m for m in motions if m["seconds_at"]]
    mean = sum(m["seconds"] for m in motions) / len(motions)
    first = max(min([mean, *(m["seconds_at"][0] for m in iterate)]), 1e-4)
    last = max([mean, first * 1.001, *(m["seconds_at"][-1] for m in iterate)])
    x, shares = [], []
    for k in range(60 if iterate else 1):
        at = first * (last / first)**(k / 59)
        hits = 0
        for m in motions:
            done = np.searchsorted(m["seconds_at"], at * (1 + 1e-9), side="right")
            hits += reached(m) if not m["seconds_at"] else done > 0 and m["iterates_m"][done - 1] <= REACHED_M
        x.append(at)
        shares.append(hits / len(motions))
    return x, shares


def solves_of(motions):
    """How often each minimizer ended how, by name, with its mean iterations."""
    counts = {}
    for motion in motions:
        for minimizer, linear, iterations, termination in motion["solves"]:
            with_linear = f", {linear}" if linear else ""
            counts.setdefault(f"{minimizer}{with_linear}: {termination}", []).append(iterations)
    return [{"solver": name, "count": len(all_), "iterations_mean": sum(all_) / len(all_)}
            for name, all_ in sorted(counts.items())]


def method_plan(options, starts):
    """[(row, parts)] of the methods asked for; the intention has a row for each deadline."""
    here, _ = starts.of(options.weights)
    order = spread_cases(len(here), options.samples)
    indices = order[:options.goals] if options.goals else order
    plan = []
    for name, (label, method, kwargs) in METHODS.items():
        if name not in options.methods and "all" not in options.methods:
            continue
        deadlines = ["adaptive"]
        if method == "intention":
            deadlines = [d for d in ("fixed", "adaptive") if options.deadline in ("both", d)]
        for deadline in deadlines:
            key, title = name, label
            if method == "intention":
                key = ("intention" + ("-fixed" if deadline == "fixed" else "") +
                       ("-refit" if kwargs else ""))
                title = f"intention, {deadline} deadline{', refitted' if kwargs else ''}"
            cases = cases_of(here, options.samples, deadline)
            plan.append(({"method": key, "label": title, "cases": [cases[i] for i in indices]},
                         parts_of(f"method_{key}", SLOW_BLOCK, method,
                                  {**common_kwargs(options, options.weights, deadline), **kwargs},
                                  here, cases, indices)))
    return plan, len(order)


def methods(options):
    starts = Starts(options.starts)
    plan, total = method_plan(options, starts)
    captured = run(options, starts, plan)
    rows = [row for row, _ in plan]
    goals = len(rows[0]["motions"])
    notes = notes_of(
        f"goals in all directions, 0 to 1.8 m high and 0.5 to 5 m away, 8 s at 30 fps; {goals} of its "
        f"{total} motions" + (", spread evenly over starts, directions, heights, distances and "
                              "samples" if goals < total else "") +
        f"; network {starts.of(options.weights)[1]['weights']}.", starts,
        "Feet: fraction of motions and of frames with all ankles and balls of the feet above 12 cm; "
        "the same for a pelvis speed above 2 m/s. Latents: root mean square; 1 for a random sample.")
    notes.append(
        "VAE + opt: the network without intention; the latents of a random rollout are optimized so that "
        "the wrist is at the goal in the last frame, with the objective 0.5 |W - G|^2 / m^2 + "
        "0.5e-6 |z|^2. The paper names neither objective nor optimizer; L-BFGS with step 1 and no line "
        "search is a setting of its released code. Motions are those of the last iterate. "
        "Levenberg-Marquardt restarts from other latents, at most twice, if it misses.")
    results = results_of("holdfast/evaluate-reach-methods/1", options, starts, notes)
    results["goals"] = goals
    results["paper"] = [{"label": label, "success_ratio": sr, "foot_skating_ratio": fs,
                         "distance_to_goal_mean_m": dtg} for label, sr, fs, dtg in PAPER_METHODS]
    table = [[label, percent(sr, 0), "-", "-", fixed(100 * dtg, 1, "cm"), "-", percent(fs, 0),
              *["-"] * (len(METHOD_HEADS) - 7)] for label, sr, fs, dtg in PAPER_METHODS]
    walking = [motion for motion in captured if motion["walks"]]
    groups = {"all": (f"captured, {len(captured)} held-out clips", captured),
              "walking": (f"captured, the {len(walking)} that move a meter or more", walking)}
    for key, (label, some) in groups.items():
        if some:
            results.setdefault("captured", {})[key] = manner(some)
            table.append([label, *["-"] * 5, *manner_cells(manner(some)), "-"])
    results["methods"] = []
    times = {}
    for row in rows:
        some = row["motions"]
        summary = {**manner(some), **success(some),
                   "success_at_any_iterate_ratio":
                       sum(reached(m) or any(d <= REACHED_M for d in m["iterates_m"])
                           for m in some) / len(some),
                   "latent_rms_mean": sum(m["latent_rms"] for m in some) / len(some)}
        x, share = success_by_seconds(some)
        times[row["method"]] = {"seconds_mean": sum(m["seconds"] for m in some) / len(some),
                                "success_by_seconds": {"seconds": x, "success_ratio": share}}
        results["methods"].append({
            "method": row["method"], "label": row["label"], "summary": summary,
            "solves": solves_of(some), "success_by_iteration": success_by_iteration(some),
            **by_place(row["cases"], some)})
        table.append([row["label"], percent(summary["success_ratio"]),
                      percent(summary["success_at_end_ratio"]), percent(summary["rests_ratio"]),
                      fixed(100 * summary["distance_to_goal_mean_m"], 1, "cm"),
                      fixed(100 * summary["distance_to_goal_median_m"], 1, "cm"),
                      *manner_cells(summary), fixed(summary["latent_rms_mean"], 2)])
    curves = [(row["label"], row["motions"]) for row in rows]
    output = options.output
    figures = [
        _study.figure(output / "iterations.png", draw_curves(
            [(label, range(len(success_by_iteration(some))), success_by_iteration(some))
             for label, some in curves], "Within 10 cm, by iterations", "iterations")),
        _study.figure(output / "tolerance.png",
                      draw_curves([tolerance(*curve) for curve in curves], "Success by tolerance",
                                  "m", limit=REACHED_M)),
        _study.figure(output / "place.png", draw_places(
            [(row["label"], row["cases"], row["motions"]) for row in rows]), 2, 2)]
    _study.figure(output / "timing.png", draw_curves(
        [(label, *success_by_seconds(some)) for label, some in curves], "Within 10 cm, by time",
        "seconds of one core per motion", logarithmic=True))
    write(options, results, times, "Reaching, by method", notes,
          _study.markdown(METHOD_HEADS, table), figures)
    for row in rows:
        seconds = times[row["method"]]["seconds_mean"]
        print(f"{row['label']}: {seconds:.{3 if seconds < 0.1 else 2}f} s per motion")


# --- Goals that move ---

EVENT_EVERY, RECOVERS_IN, TRACK_FRAMES = 150, 120, 600  # frames


def draw_track(kind, start, seed, frames):
    """A goal for each frame, pushes {frame: meters}, and frames of events.

    Begins half a meter ahead of the person; every 2 s it turns anew, at up to 90 degrees a second,
    and heads for another height of 0.7 to 1.5 m at up to 0.4 m/s. 'turns': 1 m/s; 'jumps': 0.5 m/s,
    and 1 m at once every 5 s; 'pushes': 0.5 m/s, and the body is pushed by 0.3 m every 5 s; 'lines':
    straight on, at one speed of 0.2 to 0.6 m/s."""
    draws = iter(_study.uniforms(8 + frames // 20, seed, 7 + KINDS.index(kind)))

    def between(low, high):
        return low + (high - low) * float(next(draws))

    ahead = start["ahead"]
    azimuth = math.atan2(ahead[1], ahead[0])
    goal = [start["pelvis"][k] + 0.5 * ahead[k] for k in range(3)]
    goal[2] = between(0.7, 1.5)
    speed = 1.0 if kind == "turns" else between(0.2, 0.6) if kind == "lines" else 0.5
    turn, height = 0.0, goal[2]
    goals, pushes, events = [], {}, []
    for t in range(frames):
        if t % 60 == 0:
            turn = 0.0 if kind == "lines" else between(-0.5, 0.5) * math.pi
            height = between(0.7, 1.5)
        azimuth += turn / RATE
        goal[0] += speed / RATE * math.cos(azimuth)
        goal[1] += speed / RATE * math.sin(azimuth)
        goal[2] += min(max(height - goal[2], -0.4 / RATE), 0.4 / RATE)
        if kind in ("jumps", "pushes") and t > 0 and t % EVENT_EVERY == 0:
            way = between(0.0, 2.0 * math.pi)
            by = (math.cos(way), math.sin(way), 0.0)
            if kind == "jumps":
                goal = [goal[k] + by[k] for k in range(3)]
            else:
                pushes[t] = [0.3 * value for value in by]
            if t + RECOVERS_IN <= frames:
                events.append(t)
        goals.append(list(goal))
    return goals, pushes, events


def follow(part):
    """One track, followed and measured."""
    goals, pushes, events = draw_track(part["kind"], part["start"], part["seed"], part["frames"])
    clip = part["clip"]
    follower = holdfast.GoalFollower(
        clip=clip and holdfast.Clip(clip["poses"], clip["trans"], frame_rate=RATE),
        weights=part["weights"], seed=part["seed"])
    seconds, slowest = 0.0, 0.0
    for t, goal in enumerate(goals):
        if t in pushes:
            follower.push(pushes[t])
        began = time.process_time()
        follower.step(goal)
        took = time.process_time() - began
        seconds += took
        slowest = max(slowest, took)
    walk = holdfast.walk(on_mean_body(follower.clip), skating=True)
    joints = walk["joints"]
    distance = np.linalg.norm(joints[1:, WRIST] - goals, axis=1)
    motion = measure(joints)
    body = joints[:, NECK] - joints[:, FEET].mean(1)
    leans = np.degrees(np.arctan2(np.linalg.norm(body[:, :2], axis=1), body[:, 2]))
    recovered = sum(bool((distance[event + 16:event + RECOVERS_IN] < REACHED_M).any())
                    for event in events)
    return {"mean_m": float(distance[min(int(RATE), len(goals) - 1):].mean()),
            "skating": walk["foot_skating_ratio"], "airborne": motion["airborne_ratio"],
            "acceleration_m_s2": motion["mean_acceleration_m_s2"],
            "lean_deg": float(np.quantile(leans, 0.95)),
            "lowest_pelvis_m": float(joints[:, 0, 2].min()),
            "lowest_foot_m": float(joints[:, FEET, 2].min()), "events": len(events),
            "recovered": recovered, "ms_per_frame": 1000 * seconds / len(goals),
            "ms_slowest": 1000 * slowest}


def track(options):
    files = clip_files(options.starts) if options.starts else []
    clips = [clip[:START_FRAME + 1] for _, clip in chosen_clips(files)] if files else []
    made = holdfast.reach_starts(clips or None, weights=options.weights, single_precision=False)
    persons = [{"poses": clip.poses.tolist(), "trans": clip.trans.tolist()} for clip in clips] or [None]
    each = options.goals or 6
    parts = {f"{kind}_{i:04d}": {"kind": kind, "seed": options.seed + i, "frames": TRACK_FRAMES,
                                 "weights": options.weights, "clip": persons[i % len(persons)],
                                 "start": made["starts"][i % len(persons)]}
             for kind in KINDS for i in range(each)}
    store = _study.Store(options.output, "tracks",
                         {"study": "track", "network": made["network"]["checksum"],
                          "starts": made["starts"], "seed": options.seed}, options.force)
    tracks = store.run(follow, parts, options.jobs)
    results = _study.head("holdfast/evaluate-track/1", options.seed)
    results.update({"network": made["network"], "starts": options.starts,
                    "seconds_of_each_track": TRACK_FRAMES / RATE, "kinds": []})
    rows, times = [], {}
    for kind in KINDS:
        some = [tracks[f"{kind}_{i:04d}"] for i in range(each)]
        mean = {key: sum(one[key] for one in some) / each
                for key in ("mean_m", "skating", "airborne", "acceleration_m_s2", "lean_deg", "ms_per_frame")}
        events, recovered = (sum(one[key] for one in some) for key in ("events", "recovered"))
        worst, pelvis, foot = (pick(one[key] for one in some) for pick, key in
                               ((max, "mean_m"), (min, "lowest_pelvis_m"), (min, "lowest_foot_m")))
        results["kinds"].append({
            "kind": kind, "tracks": each, "goal_distance_after_1_s_mean_m": mean["mean_m"],
            "goal_distance_of_the_worst_track_m": worst, "foot_skating_ratio": mean["skating"],
            "airborne_ratio": mean["airborne"], "acceleration_mean_m_s2": mean["acceleration_m_s2"],
            "lean_95th_percentile_mean_deg": mean["lean_deg"],
            "lowest_pelvis_m": pelvis, "lowest_foot_joint_m": foot, "events": events,
            "recovered": recovered})
        times[kind] = {"ms_per_frame": mean["ms_per_frame"],
                       "ms_slowest_frame": max(one["ms_slowest"] for one in some)}
        rows.append([kind, fixed(100 * mean["mean_m"], 1, "cm"), fixed(100 * worst, 1, "cm"),
                     percent(mean["skating"]), percent(mean["airborne"]),
                     fixed(mean["acceleration_m_s2"], 1, "m/s2"),
                     fixed(mean["lean_deg"], 0, "deg"), fixed(pelvis, 2, "m"),
                     f"{recovered} of {events}" if events else "-"])
    table = _study.markdown(["goals", "distance after 1 s", "worst track", "FS", "airborne",
                             "acceleration", "lean, 95th percentile", "lowest pelvis", "recovered"], rows)
    write(options, results, times, "Moving goals", [], table, [])
    for kind in KINDS:
        print(f"{kind}: {times[kind]['ms_per_frame']:.1f} ms per frame")


def main(arguments):
    parser = _study.parser(
        "reach", __doc__,
        "reach -o out/reach\n"
        "  python3 -m holdfast.evaluate reach --starts captured/held_out -o out/mine\n"
        "  python3 -m holdfast.evaluate reach --methods all --goals 150 -o out/methods\n"
        "  python3 -m holdfast.evaluate reach --track --starts captured/held_out -o out/track")
    parser.set_defaults(seed=1)
    parser.add_argument("--weights", default="", help="network (.safetensors) in place of the embedded one")
    parser.add_argument("--starts", nargs="+", default=[],
                        help="held-out captured clips, or folders of them, to start from: frame 25 of "
                             "six clips, of different people if possible [six composed poses]")
    parser.add_argument("--ablation-weights", action="append", default=[], metavar="NAME=FILE",
                        help="network trained without parts of the intention, for the row wrist, "
                             "wrist+pelvis, wrist+heading or none; other rows mask one network")
    parser.add_argument("--rows", type=lambda text: text.split(","), default=list(VARIANTS),
                        help="rows of the table, comma-separated: " + ", ".join(VARIANTS) + " [all]")
    parser.add_argument("--deadline", choices=["both", "adaptive", "fixed"], default="both",
                        help="when goals are due: from their distance (adaptive), or after 8 s (fixed)")
    parser.add_argument("--samples", type=int, default=5, help="number of motions per goal; the paper has 5")
    parser.add_argument("--sigma", type=float, default=1.0, help="standard deviation of the latents")
    parser.add_argument("--methods", type=lambda text: text.split(","), default=None,
                        help="methods to compare in place of ablations, comma-separated: all, or some of "
                             + ", ".join(METHODS))
    parser.add_argument("--goals", type=int, default=0,
                        help="number of the protocol's motions, evenly spread, for slow methods; 0: "
                             "all. A later run with more reuses these. With --track: number of goals "
                             "of each kind [6]")
    parser.add_argument("--track", action="store_true",
                        help="follow moving goals frame by frame for 20 s: at 1 m/s with turns, with "
                             "jumps of 1 m, with pushes of 0.3 m, slowly along lines")
    options = parser.parse_args(arguments)
    for option, given, known in (("--methods", options.methods or [], [*METHODS, "all"]),
                                 ("--rows", options.rows, list(VARIANTS))):
        for name in given:
            if name not in known:
                parser.error(f"{option}: no '{name}'. Known: {', '.join(known)}")
    if options.track and options.methods:
        parser.error("--track: not together with --methods")
    if not (1 <= options.samples <= 100 and 0 <= options.sigma <= 3 and options.goals >= 0):
        parser.error("--samples: 1 to 100; --sigma: 0 to 3; --goals: 0 or more")
    compares = options.goals > 0 or options.methods is not None
    options.methods = options.methods or ["intention"]
    (track if options.track else methods if compares else ablations)(options)
    return 0
