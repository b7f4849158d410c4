# SPDX-License-Identifier: MIT
"""Sets of motions compared with captured ones: gait, posture, smoothness.

Every measure is one number of one motion at 30 Hz on the ground z = 0; docs/metrics.md,
Naturalness, defines them. Sets are compared by the 1-Wasserstein distance of their values to those
of the reference (the first set), in deviations of the reference.
"""

import functools
import logging
import math
import pathlib

import numpy as np

import holdfast

from . import _study
from ._study import or_none
from .reach import measure as measure_reach

RATE = 30.0
TRAVEL_FRAMES, TURN_FRAMES = 7, 4  # to both sides: half a second in all, a quarter of a second
MOVING_M_S, SPEEDING_M_S, SIDEWAYS_DEG = 0.3, 2.0, 45.0
STILL_ARM_M, USUAL_STRIDE_S, SHORTEST_STRIDE_M = 0.01, 1.1, 0.3
SWAY_M_S, ARRIVED = 0.1, 0.95
WINDOW, SHORTEST_WINDOW, STEP_HZ = 64, 16, 0.25  # of spectra: samples
COMPARED, MOST, DEALS, HAND_DRAWS = 64, 5.0, 1000, 500_000
NECK, LEFT_SHOULDER, RIGHT_SHOULDER, WRISTS, ANKLES = 12, 16, 17, (20, 21), (7, 8)

# key | label | unit | resolution: smaller differences mean nothing to an eye | asked of walks only
MEASURES = [(key, label, unit, float(resolution), bool(walks)) for key, label, unit, resolution, walks
            in (line.split("|") for line in """\
left_planted_ratio|left foot planted||0.05|walks
right_planted_ratio|right foot planted||0.05|walks
both_planted_ratio|both planted||0.05|walks
none_planted_ratio|none planted||0.02|walks
stance_s|stance|s|0.05|walks
step_length_m|step length|m|0.05|walks
step_frequency_hz|step frequency|Hz|0.1|walks
walk_ratio_m_per_hz|step length by frequency|m/Hz|0.03|walks
foot_lift_m|foot lift|m|0.02|walks
contact_drift_m|drift of a contact|m|0.005|
contact_drift_p95_m|drift, 95th percentile|m|0.01|
skating_ratio|FS||0.02|
skating_joints_ratio|FS, foot joints||0.02|
airborne_ratio|both over 12 cm||0.005|
sole_depth_m|sole below ground|m|0.005|
sole_depth_p99_m|below ground, 99th percentile|m|0.01|
speed_moving_m_s|speed while moving|m/s|0.1|walks
speed_p95_m_s|speed, 95th percentile|m/s|0.1|walks
speed_peak_m_s|speed, peak|m/s|0.1|walks
speeding_ratio|over 2 m/s||0.005|
fastest_fifth_ratio|path in the fastest fifth||0.05|walks
half_way_ratio|half of the path at||0.05|walks
pelvis_bob_m|vertical pelvis movement|m|0.003|walks
heading_off_deg|heading to travel direction|deg|3|walks
sideways_ratio|moving sideways||0.03|walks
turn_rate_p95_deg_s|turn rate, 95th percentile|deg/s|10|
arm_swing_left_m|arm swing, left|m|0.02|walks
arm_swing_right_m|arm swing, right|m|0.02|walks
arm_leg_correlation|correlation of arms and opposite legs||0.1|walks
lean_moving_deg|lean of the trunk, moving|deg|2|walks
lean_deg|lean of the trunk|deg|2|
lean_p95_deg|lean, 95th percentile|deg|3|
acceleration_m_s2|acceleration|m/s2|0.5|
acceleration_p99_m_s2|acceleration, 99th percentile|m/s2|2|
jerk_m_s3|jerk|m/s3|10|
power_0_1_hz_ratio|power, 0 to 1 Hz||0.02|
power_1_2_hz_ratio|power, 1 to 2 Hz||0.02|
power_2_4_hz_ratio|power, 2 to 4 Hz||0.02|
power_4_8_hz_ratio|power, 4 to 8 Hz||0.02|
power_8_15_hz_ratio|power, 8 to 15 Hz||0.02|
beyond_limits_ratio|beyond joint limits||0.002|
beyond_limits_deg|excess over joint limits|deg|2|
hand_way_m|hand displacement|m|0.05|
hand_way_s|duration of hand movement|s|0.1|
hand_peak_m_s|hand speed, peak|m/s|0.1|
hand_time_to_peak_ratio|time to hand's peak speed||0.05|
hand_straightness_ratio|straightness of hand path||0.03|
hand_submovements|hand submovements||0.5|
""".splitlines())]
KEYS = [key for key, *_ in MEASURES]
BODY = next(k for k, key in enumerate(KEYS) if key.startswith("hand_"))  # measures of the whole body
# key: title, x, y, first x, step, points, whether it is a histogram, whether of walks only
CURVES = {
    "speed_profile": ("Speed of the pelvis on its path", "share of the time until arrival", "m/s",
                      0.0, 1 / 40, 40, False, True),
    "power": ("Acceleration by frequency", "Hz", "m2/s4 per Hz", 0.0, STEP_HZ, 61, False, True),
    "speeds": ("Speed of the pelvis", "m/s", "share of frames", 0.0, 0.1, 30, True, False),
    "headings": ("Heading to travel direction", "degrees", "share of moving frames", 0.0, 7.5, 24, True, True),
    "leans": ("Lean of the trunk", "degrees", "share of frames", 0.0, 3.0, 30, True, False),
    "step_lengths": ("Step length", "m", "share of steps", 0.0, 0.05, 24, True, True),
    "hand_speed": ("Speed of the hand on its path", "share of its time", "share of its greatest", 0.0,
                   1 / 40, 40, False, False),
}


# --- One motion ---

def mean(values):
    return float(np.mean(values)) if len(values) else math.nan


def quantile(values, share):
    return float(np.quantile(values, share)) if len(values) else math.nan


def share_above(values, limit):
    return mean(np.asarray(values) > limit)


def histogram(values, curve):
    begin, step, points = CURVES[curve][3:6]
    if not len(values):
        return []
    bins = np.clip(np.floor((np.asarray(values) - begin) / step), 0, points - 1).astype(int)
    return (np.bincount(bins, minlength=points) / len(values)).tolist()


def runs(mask):
    """[(begin, end)] of frames in a row that are set."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def strides_of(on_ground, soles):
    """Durations of stances that begin and end in the motion, and strides of 30 cm or more:
    (length and height in meters, seconds between touch-downs of one foot, NaN for the first)."""
    seconds, strides = [], []
    for foot in (2, 0):  # right, left: their heel's place among the soles
        stances = runs(on_ground[:, foot] | on_ground[:, foot + 1])
        seconds += [(end - begin) / RATE for begin, end in stances
                    if begin > 0 and end < len(soles)]
        places = [soles[(begin + end - 1) // 2, foot:foot + 2, :2].mean(0) for begin, end in stances]
        for k in range(len(stances) - 1):
            length = float(np.linalg.norm(places[k + 1] - places[k]))
            if length >= SHORTEST_STRIDE_M:
                lifted = soles[stances[k][1]:stances[k + 1][0], foot:foot + 2, 2]
                strides.append((length, float(lifted.max(initial=0.0)),
                                (stances[k + 1][0] - stances[k][0]) / RATE if stances[k][0] > 0
                                else math.nan))
    return seconds, strides


def pace(speeds):
    """(fraction of the time until arrival after which half of the path is done, fraction of the path
    in the fastest fifth of that time, mean speed in 40 parts of it) of speeds in m/s along the ground."""
    made = np.where(speeds >= SWAY_M_S, speeds, 0.0)
    sums = np.cumsum(made)
    if not len(sums) or sums[-1] <= 0:
        return math.nan, math.nan, []
    arrival = int(np.searchsorted(sums, ARRIVED * sums[-1])) + 1
    made, sums = made[:arrival], sums[:arrival]
    whole = sums[-1]
    half = int(np.searchsorted(sums, 0.5 * whole))
    before = sums[half - 1] if half else 0.0
    edges = np.interp(np.arange(41) / 40 * arrival, np.arange(arrival + 1), np.append(0.0, sums))
    fifth = 0.2 * arrival
    part = np.clip(fifth - np.arange(arrival), 0.0, 1.0)
    fastest = float((np.sort(made)[::-1] * part).sum())
    return (float((half + (0.5 * whole - before) / made[half]) / arrival), fastest / float(whole),
            (np.diff(edges) * 40 / arrival).tolist())


def power_spectrum(signals, weights):
    """Welch's estimate (61,) per Hz at 0, 0.25 .. 15 Hz of signals (T, C), densities of channels added
    up: Hann windows of 64 samples that overlap by half, those with `weights` of 1/2 or more (all where
    none has). One-sided: the integral is the mean square. None for fewer than 16 samples."""
    samples = len(signals)
    if samples < SHORTEST_WINDOW:
        return None
    window = min(samples, WINDOW)
    t = np.arange(window)
    hann = 0.5 - 0.5 * np.cos(2.0 * np.pi * (t + 0.5) / window)
    angle = 2.0 * np.pi * t[:, None] * (STEP_HZ * np.arange(61)) / RATE
    begins = list(range(0, samples - window + 1, max(window // 2, 1)))
    if begins[-1] + window < samples:
        begins.append(samples - window)
    counts = [float(np.mean(weights[begin:begin + window])) for begin in begins]
    if not any(count >= 0.5 for count in counts):
        counts = [1.0] * len(begins)
    density, total = np.zeros(61), 0.0
    for begin, count in zip(begins, counts):
        if count < 0.5:
            continue
        piece = signals[begin:begin + window].T * hann
        density += count * ((piece @ np.cos(angle))**2 + (piece @ np.sin(angle))**2).sum(0)
        total += count
    return density * (2.0 / (total * float((hann**2).sum()) * RATE))


def power_between(density, low, high):
    """Its integral over [low, high] Hz, by trapezoids."""
    at = STEP_HZ * np.arange(len(density))
    inner = at[(at > low) & (at < high)]
    x = np.concatenate(([low], inner, [high]))
    return float(np.trapz(np.interp(x, at, density), x))


def about_its_mean(signal, window):
    """A signal less its mean over `window` frames about each; NaN where the window leaves it."""
    about = np.full(len(signal), np.nan)
    sums = np.concatenate(([0.0], np.cumsum(signal - signal[0])))
    begin = np.arange(len(signal)) - window // 2
    inside = (begin >= 0) & (begin + window <= len(signal))
    first = begin[inside]
    about[inside] = signal[inside] - signal[0] - (sums[first + window] - sums[first]) / window
    return about


def measures_of(walk, limits=None):
    """(values by key, curves by key, farthest that the pelvis gets in meters) of holdfast.walk()."""
    joints, soles, yaw = walk["joints"], walk["soles"], walk["yaw"]
    count = len(joints)
    ground = joints[:, 0, :2]
    at = np.arange(count)
    begin, end = np.maximum(at - TRAVEL_FRAMES, 0), np.minimum(at + TRAVEL_FRAMES, count - 1)
    travel = (ground[end] - ground[begin]) * (RATE / np.maximum(end - begin, 1))[:, None]
    moving = np.linalg.norm(travel, axis=1) > MOVING_M_S
    on_ground = (walk["contacts"][:, None] >> np.arange(4) & 1).astype(bool)
    values, curves = {}, {}

    left, right = on_ground[moving, :2].any(1), on_ground[moving, 2:].any(1)
    values.update(left_planted_ratio=mean(left), right_planted_ratio=mean(right),
                  both_planted_ratio=mean(left & right), none_planted_ratio=mean(~(left | right)))
    depth = np.maximum(0.0, -soles[:, :, 2].min(1))
    values.update(sole_depth_m=mean(depth), sole_depth_p99_m=quantile(depth, 0.99))
    drifts = [np.linalg.norm(soles[first:last, k, :2] - soles[first, k, :2], axis=1).max()
              for k in range(4) for first, last in runs(on_ground[:, k])]
    values.update(contact_drift_m=mean(drifts), contact_drift_p95_m=quantile(drifts, 0.95))
    outcome = measure_reach(joints.astype(np.float32))
    values["airborne_ratio"] = outcome["airborne_ratio"]
    if count > 1:
        values["skating_joints_ratio"] = outcome["foot_skating_joints_ratio"]
        values["skating_ratio"] = walk["foot_skating_ratio"]

    stances, strides = strides_of(on_ground, soles)
    lengths = [0.5 * length for length, _, _ in strides]
    stride_s = quantile([seconds for *_, seconds in strides if math.isfinite(seconds)], 0.5)
    values.update(stance_s=quantile(stances, 0.5), step_length_m=quantile(lengths, 0.5),
                  foot_lift_m=quantile([height for _, height, _ in strides], 0.5),
                  step_frequency_hz=2.0 / stride_s,
                  walk_ratio_m_per_hz=quantile(lengths, 0.5) * 0.5 * stride_s)
    curves["step_lengths"] = histogram(lengths, "step_lengths")
    known_s = min(max(stride_s, 0.6), 2.0) if math.isfinite(stride_s) else USUAL_STRIDE_S
    stride_frames = math.floor(known_s * RATE + 0.5)

    speeds = np.linalg.norm(np.diff(ground, axis=0), axis=1) * RATE
    way_m = float(np.linalg.norm(ground - ground[0], axis=1).max())
    values.update(speed_moving_m_s=mean(speeds[moving[:-1]]), speed_p95_m_s=quantile(speeds, 0.95),
                  speed_peak_m_s=quantile(speeds, 1.0), speeding_ratio=share_above(speeds, SPEEDING_M_S))
    curves["speeds"] = histogram(speeds, "speeds")
    values["half_way_ratio"], values["fastest_fifth_ratio"], curves["speed_profile"] = pace(speeds)

    heading = np.stack([np.sin(yaw), -np.cos(yaw)], 1)
    direction = travel[moving] / np.linalg.norm(travel[moving], axis=1, keepdims=True)
    off = np.degrees(np.arccos(np.clip((heading[moving] * direction).sum(1), -1.0, 1.0)))
    turn = yaw[2 * TURN_FRAMES:] - yaw[:max(count - 2 * TURN_FRAMES, 0)]
    turn = np.abs(turn - 2 * np.pi * np.rint(turn / (2 * np.pi)))
    values.update(heading_off_deg=mean(off), sideways_ratio=share_above(off, SIDEWAYS_DEG),
                  turn_rate_p95_deg_s=quantile(np.degrees(turn) * RATE / (2 * TURN_FRAMES), 0.95))
    curves["headings"] = histogram(off, "headings")

    bob = about_its_mean(joints[:, 0, 2], stride_frames)[moving]
    bob = bob[np.isfinite(bob)]
    if len(bob):
        values["pelvis_bob_m"] = math.sqrt(float((bob**2).mean()))
    shoulders = 0.5 * (joints[:, LEFT_SHOULDER, :2] + joints[:, RIGHT_SHOULDER, :2])
    correlations = []
    for side, name in enumerate(("left", "right")):
        wrist = about_its_mean((heading * (joints[:, WRISTS[side], :2] - shoulders)).sum(1),
                               stride_frames)
        ankle = about_its_mean((heading * (joints[:, ANKLES[1 - side], :2] - ground)).sum(1),
                               stride_frames)
        seen = moving & np.isfinite(wrist)
        if seen.sum() < stride_frames // 2 or not seen.any():
            continue
        wrist, ankle = wrist[seen], ankle[seen]
        swing, step = (math.sqrt(2.0 * float((x**2).mean())) for x in (wrist, ankle))
        values[f"arm_swing_{name}_m"] = swing
        if swing > STILL_ARM_M and step > STILL_ARM_M:
            correlations.append(float((wrist * ankle).sum() /
                                      np.sqrt((wrist**2).sum() * (ankle**2).sum())))
    values["arm_leg_correlation"] = mean(correlations)

    trunk = joints[:, NECK] - joints[:, 0]
    lean = np.degrees(np.arctan2(np.linalg.norm(trunk[:, :2], axis=1), trunk[:, 2]))
    values.update(lean_moving_deg=mean(lean[moving]), lean_deg=mean(lean),
                  lean_p95_deg=quantile(lean, 0.95))
    curves["leans"] = histogram(lean, "leans")

    if count > 2:
        second = (joints[2:] - 2.0 * joints[1:-1] + joints[:-2]) * RATE * RATE
        acceleration = np.linalg.norm(second, axis=2).ravel()
        jerk = np.linalg.norm(np.diff(second, axis=0) * RATE, axis=2).ravel()
        values.update(acceleration_m_s2=mean(acceleration), jerk_m_s3=mean(jerk),
                      acceleration_p99_m_s2=quantile(acceleration, 0.99))
        density = power_spectrum(second.reshape(len(second), -1), moving[1:-1])
        if density is not None:
            whole = power_between(density, 0.0, 0.5 * RATE)
            for low, high in ((0, 1), (1, 2), (2, 4), (4, 8), (8, 15)):
                if whole > 0:
                    values[f"power_{low}_{high}_hz_ratio"] = power_between(density, low, high) / whole
            curves["power"] = (density / joints.shape[1]).tolist()

    if limits is not None:
        over = np.degrees(walk["angles"][:, 1:] - np.asarray(limits)[1:])
        beyond = over[over > 0]
        values["beyond_limits_ratio"] = len(beyond) / over.size
        values["beyond_limits_deg"] = mean(beyond) if len(beyond) else 0.0
    hand = dict(walk["hand"])
    curves["hand_speed"] = hand.pop("profile")
    return {**values, **hand}, curves, way_m


class Warnings(logging.Handler):
    """Warnings of the library while it reads a file."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.texts = []

    def emit(self, record):
        self.texts.append(record.getMessage())


@functools.lru_cache(maxsize=1)
def body_of(path):
    return holdfast.BodyModel.load(path) if path else None


def measure_file(part):
    """One motion of a set, measured."""
    warnings = Warnings()
    logger = logging.getLogger("holdfast")
    logger.addHandler(warnings)
    try:
        walk = holdfast.walk(part["path"], body=body_of(part["body"]), skating=True)
    finally:
        logger.removeHandler(warnings)
    frames = len(walk["joints"])
    values, curves, way_m = measures_of(walk, part["limits"]) if frames else ({}, {}, 0.0)
    return {"frames": frames, "cut": walk["cut"], "other_shape": walk["other_shape"], "way_m": way_m,
            "values": [or_none(values.get(key, math.nan)) for key in KEYS], "curves": curves,
            "second_crouch": walk["second_crouch"], "lean_back_rad": or_none(walk["lean_back_rad"]),
            "off_balance_m": or_none(walk["off_balance_m"]),
            "warnings": warnings.texts}


def leans_back(motion):
    return motion["lean_back_rad"] is not None and motion["lean_back_rad"] > math.radians(10.0)


def ends_off_balance(motion):
    return motion["off_balance_m"] is not None and motion["off_balance_m"] > 0.03


def limits_of(angles):
    """(22,) radians: 99.9th percentile of joint angles (T, 22), at least 17 degrees, plus 3."""
    ordered = np.sort(angles, axis=0)
    most = ordered[int(0.999 * (len(ordered) - 1))]
    limits = np.maximum(most, math.radians(17.0)) + math.radians(3.0)
    limits[0] = math.pi
    return limits.tolist()


def pair_distance(walks):
    """Mean joint distance over time and all pairs of motions, meters. First frames are aligned in
    position and heading, bodies have the mean shape, and shorter motions hold their last frame."""
    placed = []
    for walk in walks:
        joints = walk["mean_joints"].copy()
        cosine, sine = math.cos(-walk["yaw"][0]), math.sin(-walk["yaw"][0])
        joints[..., :2] = joints[..., :2] @ np.array([[cosine, sine], [-sine, cosine]])
        joints[..., :2] -= joints[0, 0, :2].copy()
        placed.append(joints)
    sums = []
    for i, a in enumerate(placed):
        for b in placed[:i]:
            at = np.arange(max(len(a), len(b)))
            apart = a[np.minimum(at, len(a) - 1)] - b[np.minimum(at, len(b) - 1)]
            sums.append(float(np.linalg.norm(apart, axis=2).mean()))
    return mean(sums)


# --- Sets ---

def spread_of(values):
    """Over the values of motions, each counting once: count, mean, standard error, deviation and
    quartiles; NaN where there are too few."""
    values = np.asarray(values, float)
    count = len(values)
    deviation = float(values.std(ddof=1)) if count > 1 else math.nan
    return {"motions": count, "mean": mean(values), "deviation": deviation,
            "standard_error": deviation / math.sqrt(count) if count > 1 else math.nan,
            "lower_quartile": quantile(values, 0.25), "median": quantile(values, 0.5),
            "upper_quartile": quantile(values, 0.75)}


def wasserstein(a, b):
    """The area between the distribution functions of two samples."""
    both = np.sort(np.concatenate([a, b]))
    below = [np.searchsorted(np.sort(x), both[:-1], side="right") / len(x) for x in (a, b)]
    return float((np.abs(below[0] - below[1]) * np.diff(both)).sum())


def distance_of(reference, other, resolution, seed):
    """How far a set is from the reference by one measure: ratio of the means, Cohen's d, distance in
    deviations of the reference, and the 95th percentile of that of random partitions of the motions."""
    if not len(reference) or not len(other):
        return dict.fromkeys(("ratio", "cohens_d", "distance", "distance_by_chance"), math.nan)
    a, b = np.asarray(reference, float), np.asarray(other, float)
    of_a, of_b = spread_of(a), spread_of(b)
    spread = max(of_a["deviation"], resolution) if len(a) > 1 else resolution
    squares = sum(s["deviation"]**2 * (s["motions"] - 1) for s in (of_a, of_b) if s["motions"] > 1)
    pooled = max(math.sqrt(squares / max(len(a) + len(b) - 2, 1)), resolution)
    both = np.sort(np.concatenate([a, b]))
    gaps, total = np.diff(both), len(both)
    draws = holdfast.random_draws(seed, DEALS * (total - 1)).reshape(DEALS, total - 1)
    left, first, dealt = np.full(DEALS, len(a)), np.zeros(DEALS, int), np.zeros(DEALS)
    for i in range(total - 1):
        to_first = (draws[:, i] * (total - i)).astype(int) < left
        left -= to_first
        first += to_first
        dealt += np.abs(first / len(a) - (i + 1 - first) / len(b)) * gaps[i]
    return {"ratio": of_b["mean"] / of_a["mean"] if of_a["mean"] != 0 else math.nan,
            "cohens_d": (of_b["mean"] - of_a["mean"]) / pooled, "distance": wasserstein(a, b) / spread,
            "distance_by_chance": quantile(dealt / spread, 0.95)}


class Column:
    """A measured set of motions, and how far it is from the reference."""

    def __init__(self, label, names, motions, options):
        kept = [k for k, motion in enumerate(motions)
                if not options.moving_only or motion["way_m"] >= options.way]
        if not kept:
            raise holdfast.Error(f"{label}: none of its {len(motions)} motions moves {options.way:g} m. "
                                 "Give other motions or a smaller --way, or leave out --moving-only")
        self.label, self.way = label, options.way
        self.names, self.motions = [names[k] for k in kept], [motions[k] for k in kept]
        self.spread = [spread_of(self.values(m)) for m in range(len(MEASURES))]

    def asked(self, motion, m):
        return not MEASURES[m][4] or motion["way_m"] >= self.way

    def values(self, m):
        return [motion["values"][m] for motion in self.motions
                if self.asked(motion, m) and motion["values"][m] is not None]

    def count(self, counts):
        return sum(map(counts, self.motions))

    def compare(self, reference, options, number):
        """Every cell has its own random draws, so results do not depend on other options."""
        self.distance = []
        for m in range(len(MEASURES) if options.hands else BODY):
            cell = number * (len(MEASURES) if options.hands else BODY) + m
            draw = number * BODY + m if m < BODY else HAND_DRAWS + cell
            self.distance.append(distance_of(reference.values(m), self.values(m), MEASURES[m][3],
                                             options.seed * 1_000_003 + draw))
        self.mean = [self.mean_over(0, BODY, key) for key in ("distance", "distance_by_chance")]
        self.hand = [self.mean_over(BODY, len(self.distance), key)
                     for key in ("distance", "distance_by_chance")]

    def mean_over(self, begin, end, key):
        some = [min(d[key], MOST) for d in self.distance[begin:end] if math.isfinite(d["distance"])]
        return sum(some) / max(len(some), 1)

    def set_apart_by(self):
        shown = [(-d["distance"], m) for m, d in enumerate(self.distance)
                 if d["distance"] > d["distance_by_chance"]]
        return [m for _, m in sorted(shown)]

    def oddness(self, motion, reference):
        """(mean over measures of |value - mean| / deviation, each at most 5; the farthest's number)"""
        offs = []
        for m in range(BODY):
            value, spread = motion["values"][m], reference.spread[m]
            if value is None or spread["motions"] == 0 or not self.asked(motion, m):
                continue
            deviation = spread["deviation"]
            deviation = max(deviation, MEASURES[m][3]) if math.isfinite(deviation) else MEASURES[m][3]
            offs.append((abs(value - spread["mean"]) / deviation, -m))
        if not offs:
            return math.nan, None
        return sum(min(off, MOST) for off, _ in offs) / len(offs), -max(offs)[1]

    def curve(self, key):
        """Mean and quartiles of a curve over the motions that have it."""
        walks = CURVES[key][7]
        curves = [motion["curves"][key] for motion in self.motions if motion["curves"].get(key) and
                  (not walks or motion["way_m"] >= self.way)]
        if not curves:
            return {"motions": 0}
        low, median, high = np.quantile(curves, [0.25, 0.5, 0.75], axis=0)
        return {"motions": len(curves), "mean": np.mean(curves, 0).tolist(),
                "lower_quartile": low.tolist(), "median": median.tolist(), "upper_quartile": high.tolist()}


def motion_files(path):
    """[(path, name)]: a clip by itself, or all clips (.npz) of a folder and below. Where samples lie
    beside a clip.npz, that is the best of them and left out."""
    folder = pathlib.Path(path)
    if not folder.is_dir():
        return [(str(path), folder.stem)]
    files = [file for file in sorted(folder.rglob("*.npz"), key=str)
             if not (file.name == "clip.npz" and (file.parent / "samples").is_dir())]
    if not files:
        raise holdfast.Error(f"{path}: contains no clip (.npz). Give the folder of the clips")
    return [(str(file), str(file.relative_to(folder).with_suffix(""))) for file in files]


def sets_of(options):
    """{label: [(path, name)]}, the reference first."""
    sets = {"captured": [file for path in options.reference for file in motion_files(path)]}
    for text in options.against:
        label, equals, path = text.partition("=")
        if not equals or pathlib.Path(text).exists():
            label, path = pathlib.Path(text).resolve().name, text
        if not label or not path:
            raise holdfast.Error(f"--against {text}: is not a set. Give LABEL=FOLDER or a folder")
        if label == "captured":
            raise holdfast.Error(f"--against {text}: has the name of the reference. Give it a "
                                 f"different name: LABEL={path}")
        sets.setdefault(label, []).extend(motion_files(path))
    if options.at_most > 0:
        for files in sets.values():
            if len(files) > options.at_most:
                files[:] = [files[i * len(files) // options.at_most] for i in range(options.at_most)]
    return sets


# --- Motions made from a list of starts and goals ---

def read_reaches(table, root):
    """[(clip, frame, (ahead, left, up))] of a table of starts and goals."""
    lines = pathlib.Path(table).read_text(encoding="utf-8").splitlines()
    if not lines or lines[0].strip() != "clip,frame,ahead,left,up":
        raise holdfast.Error(f"{table}:1: is not 'clip,frame,ahead,left,up'. Begin the table with this line")
    listed = []
    for number, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        cells = line.split(",")
        try:
            frame, goal = int(cells[1]), [float(cell) for cell in cells[2:]]
            if len(goal) != 3 or not np.isfinite(goal).all() or frame < 0:
                raise ValueError
        except (ValueError, IndexError):
            raise holdfast.Error(f"{table}:{number}: is not a clip and four numbers. Give "
                                 "clip,frame,ahead,left,up: frame from 0, meters") from None
        clip = pathlib.Path(root) / cells[0]
        if not cells[0] or not clip.is_file():
            raise holdfast.Error(f"{table}:{number}: names a clip that does not exist: {clip}. "
                                 "Give the folder of its clips with --reaches-root")
        listed.append((str(clip), frame, goal))
    if not listed:
        raise holdfast.Error(f"{table}: lists no reaches. Give one line per reach")
    return listed


def make_reach(part):
    """Saves a motion of holdfast.reach() from a frame of a clip; returns the outcome of its goal."""
    body = body_of(part["body"])
    clip = holdfast.Clip.load(part["clip"], body=body)
    walk = holdfast.walk(part["clip"], body=body)
    at = min(math.floor(part["frame"] * RATE / clip.frame_rate + 0.5), len(walk["joints"]) - 1)
    sine, cosine = math.sin(walk["yaw"][at]), math.cos(walk["yaw"][at])
    ahead, left, up = part["goal"]
    pelvis = walk["joints"][at, 0]
    goal = np.array([pelvis[0] + ahead * sine + left * cosine, pelvis[1] - ahead * cosine + left * sine,
                     up])
    made = holdfast.reach(goal, clip=part["clip"], frame=part["frame"], method=part["method"], body=body,
                          weights=part["weights"], seed=part["seed"], threads=1)
    path = pathlib.Path(part["path"])
    path.parent.mkdir(parents=True, exist_ok=True)
    made.clip.save(path, force=True)
    wrist = holdfast.walk(made.clip, body=body)["joints"][-15:, 21]
    return {"reached": bool(made.reached[0]),
            "rests": len(wrist) == 15 and bool((np.linalg.norm(wrist - goal, axis=1) < 0.02).all())}


def make_reaches(options):
    """({method: files}, lines about them, their numbers)"""
    listed = read_reaches(options.reaches,
                          options.reaches_root or pathlib.Path(options.reaches).parent)
    store = _study.Store(options.output, "reaches",
                         {"reaches": _study.checksum(options.reaches), "seed": options.seed,
                          "clips": {clip: _study.checksum(clip) for clip, *_ in listed},
                          "weights": options.weights and _study.checksum(options.weights),
                          "body": options.body and _study.checksum(options.body)}, options.force)
    sets, lines, numbers = {}, [], []
    for method in options.methods:
        names = [f"reaches/{method}/{i:03d}.npz" for i in range(len(listed))]
        made = store.run(make_reach, {name: {
            "clip": clip, "frame": frame, "goal": goal, "method": method, "seed": options.seed + i,
            "weights": options.weights, "body": options.body, "path": str(options.output / name)}
            for i, (name, (clip, frame, goal)) in enumerate(zip(names, listed))}, options.jobs)
        reached, rests = (sum(one[key] for one in made.values()) for key in ("reached", "rests"))
        sets[method] = [(str(options.output / name), name) for name in names]
        lines.append(f"{method}: {reached} of {len(listed)} goals reached; the wrist within 2 cm in all "
                     f"of the last half second in {rests}\n")
        numbers.append({"method": method, "motions": len(listed), "reached": reached,
                        "wrist_rests_within_2_cm": rests})
    return sets, lines, numbers


# --- What is written ---

def for_people(m):
    """(factor, unit, digits) of a measure's numbers: shares in %, lengths in cm."""
    key, _, unit, resolution, _ = MEASURES[m]
    factor = 100.0 if key.endswith("_ratio") or unit == "m" else 1.0
    shown = factor * resolution
    digits = 3 if shown < 0.05 else 2 if shown < 0.5 else 1 if shown < 5.0 else 0
    return factor, "%" if key.endswith("_ratio") else "cm" if unit == "m" else unit, digits


def row_of(columns, m):
    factor, unit, digits = for_people(m)
    row = [MEASURES[m][1] + (f", {unit}" if unit else "")]
    for k, column in enumerate(columns):
        spread = column.spread[m]
        cell = "-" if spread["motions"] == 0 else f"{factor * spread['mean']:.{digits}f}"
        if math.isfinite(spread["standard_error"]):
            cell += f" ± {factor * spread['standard_error']:.{digits}f}"
        row.append(cell)
        if k > 0:
            distance = column.distance[m]
            shown = distance["distance"] > distance["distance_by_chance"]
            row.append(_study.fixed(distance["distance"], 2) +
                       ("" if shown or not math.isfinite(distance["distance"]) else " (chance)"))
    return row


def mean_row(columns, label, key):
    cells = [cell for column in columns[1:]
             for cell in ("", f"{getattr(column, key)[0]:.2f} (chance: {getattr(column, key)[1]:.2f})")]
    return [label, "", *cells]


def apart_text(column, reference, most=6):
    parts = []
    for m in column.set_apart_by()[:most]:
        factor, unit, digits = for_people(m)
        parts.append(f"{MEASURES[m][1]} ({factor * column.spread[m]['mean']:.{digits}f} for "
                     f"{factor * reference.spread[m]['mean']:.{digits}f} {unit}; "
                     f"{column.distance[m]['distance']:.1f})")
    return ", ".join(parts) or "no significant difference"


def table_of(columns, hands):
    reference = columns[0]
    text = "".join(f"{c.label}: {len(c.motions)} motions, "
                   f"{c.count(lambda m, c=c: m['way_m'] >= c.way)} of them walks, "
                   f"{c.count(lambda m: m['frames']) / RATE / 60:.1f} min\n" for c in columns)
    rows = [row_of(columns, m) for m in range(len(MEASURES) if hands else BODY)]
    if len(columns) > 1:
        rows.append(mean_row(columns, "mean over measures without the hand's, each at most 5" if hands else
                             "mean over measures, each at most 5", "mean"))
        if hands:
            rows.append(mean_row(columns, "mean over the hand's measures", "hand"))
    heads = ["measure", reference.label] + [h for c in columns[1:] for h in (c.label, "distance")]
    text += "\n" + _study.markdown(heads, rows, numbers=True) + "\n"
    for column in columns:
        share = 100 / len(column.motions)
        text += (f"{column.label}: {share * column.count(lambda m: m['second_crouch'] >= 0):.1f} % crouch "
                 f"twice on the way, {share * column.count(leans_back):.1f} % lean back by more than 10 "
                 f"degrees while waiting, {share * column.count(ends_off_balance):.1f} % end with the center of "
                 "mass more than 3 cm outside of the feet\n")
    for column in columns:
        if math.isfinite(column.pair_m):
            text += (f"{column.label}: joints of two motions are {100 * column.pair_m:.1f} cm apart on "
                     "average")
            text += (f", {column.pair_m / reference.pair_m:.2f} of {reference.label}\n"
                     if column is not reference and reference.pair_m > 0 else "\n")
    for column in columns[1:]:
        text += f"\nSignificant differences of {column.label}: {apart_text(column, reference)}.\n"
    return text


def results_of(columns, notes, options):
    reference = columns[0]
    results = _study.head("holdfast/evaluate-naturalness/1", options.seed)
    results.update(notes=notes, sets=[], measures=[], curves={})
    for column in columns:
        one = {"label": column.label, "motions": len(column.motions),
               "walks": column.count(lambda m, c=column: m["way_m"] >= c.way),
               "minutes": column.count(lambda m: m["frames"]) / RATE / 60,
               "crouch_twice": column.count(lambda m: m["second_crouch"] >= 0),
               "lean_back": column.count(leans_back),
               "end_off_balance": column.count(ends_off_balance), "pair_distance_m": or_none(column.pair_m)}
        if column is not reference:
            one["mean_distance"], one["mean_distance_by_chance"] = column.mean
            if options.hands:
                one["hand_distance"], one["hand_distance_by_chance"] = column.hand
            one["set_apart_by"] = [KEYS[m] for m in column.set_apart_by()]
        odd = sorted(((-value, k, most) for k, (value, most) in enumerate(column.odd)
                      if math.isfinite(value)))[:5]
        one["oddest"] = [{"motion": column.names[k], "oddness": -value, "farthest_off": KEYS[most],
                          "value": column.motions[k]["values"][most]} for value, k, most in odd]
        results["sets"].append(one)
    for m in range(len(MEASURES) if options.hands else BODY):
        key, label, unit, resolution, walks = MEASURES[m]
        sets = [{k: or_none(v) for k, v in {**c.spread[m], **(c.distance[m] if c is not reference else {})}
                 .items()} for c in columns]
        results["measures"].append({"key": key, "label": label, "unit": unit, "of_walks": walks,
                                    "resolution": resolution, "sets": sets})
    for key in list(CURVES)[:None if options.hands else -1]:
        title, x_label, y_label, *_ = CURVES[key]
        results["curves"][key] = {"label": title, "x_label": x_label, "y_label": y_label,
                                  "x": curve_x(key), "sets": [c.curve(key) for c in columns]}
    return results


def curve_x(key):
    begin, step, points = CURVES[key][3:6]
    return [begin + (i + (0.0 if key == "power" else 0.5)) * step for i in range(points)]


def motions_csv(columns, hands):
    keys = KEYS if hands else KEYS[:BODY]
    lines = [",".join(["set,motion,frames,way_m,oddness,crouches_twice,lean_back_rad,off_balance_m", *keys])]
    for column in columns:
        for name, motion, (odd, _) in zip(column.names, column.motions, column.odd):
            lean, off = motion["lean_back_rad"], motion["off_balance_m"]
            cells = ['"' + text.replace('"', '""') + '"' for text in (column.label, name)]
            cells += [str(motion["frames"]), f"{motion['way_m']:.4f}", f"{odd:.4f}",
                      str(int(motion["second_crouch"] >= 0)), "" if lean is None else f"{lean:.4f}",
                      "" if off is None else f"{off:.4f}"]
            cells += ["" if v is None else f"{v:.6g}" for v in motion["values"][:len(keys)]]
            lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def draw_curves(columns, keys):
    def draw(axes):
        for ax, key in zip(axes, keys):
            title, x_label, y_label, *_ = CURVES[key]
            is_histogram = CURVES[key][6]
            for column in columns:
                curve = column.curve(key)
                if not curve["motions"]:
                    continue
                y = np.array(curve["mean" if is_histogram else "median"])
                ax.plot(curve_x(key), 100 * y if is_histogram else y,
                        label=f"{column.label} ({curve['motions']})")
                if not is_histogram:
                    ax.fill_between(curve_x(key), curve["lower_quartile"], curve["upper_quartile"],
                                    alpha=0.2)
            ax.set(title=title, xlabel=x_label,
                   ylabel="%" + y_label[len("share"):] if is_histogram else y_label + ", median, quartiles",
                   yscale="log" if key == "power" else "linear")
            ax.legend(fontsize="x-small")
    return draw


def draw_distances(columns):
    """Measures, sorted by their farthest set; gray: the distance by chance."""
    def draw(ax):
        farthest = [max((c.distance[m]["distance"] for c in columns[1:]
                         if math.isfinite(c.distance[m]["distance"])), default=math.nan)
                    for m in range(len(columns[1].distance))]
        order = sorted((m for m in range(len(farthest)) if math.isfinite(farthest[m])),
                       key=lambda m: farthest[m])
        for column in columns[1:]:
            ax.plot([min(column.distance[m]["distance"], 6) for m in order], range(len(order)), "o",
                    label=column.label)
            ax.plot([min(column.distance[m]["distance_by_chance"], 6) for m in order],
                    range(len(order)), "|", color="gray")
        ax.set_yticks(range(len(order)), [MEASURES[m][1] for m in order], fontsize="x-small")
        ax.set(title="Distance from the reference, by measure", xlim=(0, 6.1),
               xlabel="deviations of the reference; gray: distance by chance")
        ax.legend(fontsize="x-small")
    return draw


def notes_of(options, columns):
    notes = [
        f"Motions at 30 Hz on the ground z = 0; each counts once. Measures of walks use the motions "
        f"whose pelvis moves {options.way:g} m or more from its start"
        + ("; other motions are excluded from all measures." if options.moving_only else "."),
        "Distance: 1-Wasserstein distance of the motions' values to those of the reference (the first "
        "set), in deviations of the reference (at least the smallest visible difference). By "
        "chance: 95 % of random partitions of the same motions have a smaller distance.",
        f"Joint limits are those of {', '.join(options.limits)}." if options.limits else
        "Joint limits are those of the reference."]
    for column in columns:
        cut = column.count(lambda m: m["cut"])
        if cut:
            notes.append(f"{column.label}: {cut} motions have non-finite numbers; measured up to these.")
    return notes


def study(options):
    sets, (lines, numbers) = sets_of(options), ((), None)
    if options.reaches:
        made, lines, numbers = make_reaches(options)
        sets.update(made)
    limit_files = [file for path in options.limits for file in motion_files(path)]
    question = {"study": "naturalness", "body": options.body and _study.checksum(options.body),
                "limits": [_study.checksum(path) for path, _ in limit_files or sets["captured"]]}
    body = body_of(options.body)
    limits = limits_of(np.concatenate([holdfast.walk(path, body=body)["angles"]
                                       for path, _ in limit_files or sets["captured"]]))
    store = _study.Store(options.output, "motions", question, options.force)
    parts = {path: {"path": path, "body": options.body, "limits": limits}
             for files in sets.values() for path, _ in files}
    names = {path: f"{path} {_study.checksum(path)}" for path in parts}
    measured = store.run(measure_file, {names[path]: part for path, part in parts.items()}, options.jobs)
    columns = []
    for label, files in sets.items():
        column = Column(label, [name for _, name in files],
                        [measured[names[path]] for path, _ in files], options)
        some = min(len(files), COMPARED)
        column.pair_m = pair_distance([
            holdfast.walk(files[(k * len(files) + some - 1) // some][0], body=body) for k in range(some)])
        if columns:
            column.compare(columns[0], options, len(columns))
        columns.append(column)
    for column in columns:
        column.odd = [column.oddness(motion, columns[0]) for motion in column.motions]
    notes = notes_of(options, columns)
    every = [measured[names[path]] for files in sets.values() for path, _ in files]
    shapes = sum(motion["other_shape"] for motion in every)
    if shapes:
        notes.append(f"{shapes} motions have a shape of another body model: measured on the mean shape.")
    warnings = [text for motion in every for text in motion["warnings"]]
    notes += [f"In {warnings.count(text)} files: {text}." for text in sorted(set(warnings))]
    results = results_of(columns, notes, options)
    if numbers:
        results.update(reaches=numbers, reaches_list=options.reaches)
    table = table_of(columns, options.hands) + ("\n" + "".join(lines) if lines else "")
    keys = list(CURVES)[:None if options.hands else -1]
    figures = [_study.figure(options.output / "curves.png", draw_curves(columns, keys), 3,
                             -(-len(keys) // 3))]
    if len(columns) > 1:
        figures.append(_study.figure(options.output / "distances.png", draw_distances(columns),
                                     size=(8, 10)))
    _study.write_json(options.output / "evaluation.json", results)
    _study.write_atomically(options.output / "motions.csv", motions_csv(columns, options.hands))
    _study.write_atomically(options.output / "evaluation.md", "\n".join(
        ["# Naturalness of motions\n", *(note + "\n" for note in notes), table,
         *filter(None, figures)]))
    print(table)


def main(arguments):
    parser = _study.parser(
        "naturalness", __doc__,
        "naturalness captured/held_out --against reach=reached -o out/natural\n"
        "  python3 -m holdfast.evaluate naturalness captured/held_out --at-most 200 \\\n"
        "    --against others=captured/train --against made=made --limits captured/train -o out/data")
    parser.set_defaults(seed=1)
    parser.add_argument("reference", nargs="+",
                        help="captured clips, or folders of them (searched recursively), to compare "
                             "with; preferably of people that no network was trained on")
    parser.add_argument("--against", action="append", default=[], metavar="LABEL=PATH",
                        help="a clip or folder to compare, a column of the table; may be repeated for "
                             "further sets, or to add to a label")
    parser.add_argument("--limits", action="append", default=[], metavar="PATH",
                        help="captured clips from which joint limits are taken [the reference]")
    parser.add_argument("--reaches", default="",
                        help="table of starts and goals (clip,frame,ahead,left,up per line: meters from "
                             "the pelvis along its heading, up from the ground); a motion is generated "
                             "for each line with each of --methods, which are sets to compare")
    parser.add_argument("--reaches-root", default="", help="folder of the table's clips [the table's]")
    parser.add_argument("--methods", type=lambda text: text.split(","), default=["intention", "latent-opt"],
                        help="intention, latent-opt, vae-opt, comma-separated [intention,latent-opt]")
    parser.add_argument("--weights", default="", help="network (.safetensors) in place of the embedded one")
    parser.add_argument("--body", default="", help="body model in place of the embedded one")
    parser.add_argument("--way", type=float, default=1.0,
                        help="minimum pelvis displacement for a motion to count as a walk, meters")
    parser.add_argument("--moving-only", action="store_true",
                        help="exclude motions below --way from all measures")
    parser.add_argument("--hands", action="store_true",
                        help="also measure hand movements, for motions that drink, take or reach; "
                             "averaged separately")
    parser.add_argument("--at-most", type=int, default=0,
                        help="number of motions of each set, evenly spread; 0: all")
    options = parser.parse_args(arguments)
    if options.way < 0 or options.at_most < 0:
        parser.error("--way, --at-most: 0 or more")
    if set(options.methods) - {"intention", "latent-opt", "vae-opt"}:
        parser.error("--methods: choose from intention, latent-opt, vae-opt")
    study(options)
    return 0
