# SPDX-License-Identifier: MIT
"""IMoS's Table 2 (Ghosh et al. 2023) with its ablations: motion with objects from an intent.

Networks continue held-out clips from their first four of 15 key frames. Measured by the definitions
of the authors' code and of the field, through an action classifier ('holdfast train recognizer'), with
contact of hand and object (docs/metrics.md, Synthesis).
"""

import functools
import json
import math
import pathlib
import re
import struct

import numpy as np

import holdfast

from . import _study

HISTORY, NUM_ACTIONS = 4, 29
SLOW_BLOCK, FAST_BLOCK = 16, 256  # cases of a part: where each takes a second; where many are quick
AT_FACE_M, NEARER_M = 0.25, 0.1
OBJECT_KEYS = [
    "deep_penetration_frames_ratio", "penetration_max_mm", "penetration_mean_max_mm",
    "contact_frames_ratio", "contact_slip_mm_per_frame", "contact_drift_mm",
    "jitter_acceleration_ratio", "jitter_angular_acceleration_ratio", "object_acceleration_m_s2",
    "joint_acceleration_m_s2", "foot_skate_mm_per_frame"]
LABELS = {"full": "full model", "random-embeddings": "ablation 1: random action vectors",
          "no-attention": "ablation 2: no self-attention",
          "one-module": "ablation 3: one network for the whole body"}
# Table 2, means with half their 95 % intervals: MPJPE, AVE, FID, accuracy, diversity, multimodality.
PAPER = {
    "real motion": [None, None, None, (0.97, 0.001), (1.15, 0.015), (0.30, 0.010)],
    "ACTOR": [(0.09, 0.005), (8.05, 0.002), (0.67, 0.002), (0.78, 0.010), (1.06, 0.015), (0.19, 0.010)],
    "Action2Motion":
        [(0.11, 0.003), (8.26, 0.002), (1.08, 0.002), (0.69, 0.011), (1.10, 0.010), (0.22, 0.010)],
    "TEMOS": [(0.10, 0.005), (9.98, 0.001), (1.21, 0.004), (0.23, 0.010), (0.83, 0.010), (0.09, 0.010)],
    "1: random action vectors":
        [(0.05, 0.002), (4.41, 0.002), (0.39, 0.002), (0.78, 0.012), (1.06, 0.015), (0.21, 0.010)],
    "2: no self-attention":
        [(0.04, 0.005), (4.77, 0.002), (0.38, 0.002), (0.82, 0.010), (1.10, 0.020), (0.24, 0.020)],
    "3: one net, whole body":
        [(0.05, 0.005), (5.41, 0.002), (0.42, 0.002), (0.82, 0.010), (1.08, 0.010), (0.25, 0.010)],
    "IMoS": [(0.03, 0.005), (3.82, 0.004), (0.27, 0.002), (0.87, 0.011), (1.11, 0.015), (0.28, 0.015)],
}
PAPER_KEYS = ["mpjpe_m", "ave", "fid", "accuracy_ratio", "diversity", "multimodality"]
PLACED = {
    "given": "Ground-truth object poses in the history, as in the authors' evaluation",
    "carried": "Objects fixed to the wrist that carries them in the ground truth",
    "fitted": "Objects fitted in every key frame, then strokes added: the full pipeline"}


# --- The action classifier ---

class Recognizer:
    """Tells actions from joints, and gives the features that sets are compared by: two LSTMs of two
    layers of 128, one of (x, y) and one of (x, z) of the 22 joints, a convolution along each one's last
    outputs; y is their sum. By the names and shapes of the authors' PyTorch module."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        try:
            size, = struct.unpack("<Q", data[:8])
            entries = json.loads(data[8:8 + size])
            self.notes = entries.pop("__metadata__", {})
            types = {"F32": np.float32, "F16": np.float16, "F64": np.float64}
            self.tensors = {
                name: np.frombuffer(data[8 + size:][slice(*e["data_offsets"])], types[e["dtype"]])
                .reshape(e["shape"]).astype(np.float32) for name, e in entries.items()}
            if self.notes.pop("format", "pt") not in ("imos-recognizer-1", "pt"):
                raise ValueError
            self.planes = [self._plane("2_2", [0, 1]), self._plane("2_3", [0, 2])]
            self.weight = self._tensor("hidden2label.weight", (NUM_ACTIONS, 128))
            self.bias = self._tensor("hidden2label.bias", (NUM_ACTIONS,))
        except (ValueError, KeyError, TypeError, struct.error):
            raise holdfast.Error(f"{path}: is not an action classifier. Give a file written by "
                                 "'holdfast train recognizer'") from None

    def _tensor(self, name, shape):
        tensor = self.tensors[name]
        if tensor.shape != shape or not np.isfinite(tensor).all():
            raise ValueError
        return tensor

    def _plane(self, name, coordinates):
        layers = []
        for k, inputs in enumerate((44, 128)):
            joined = np.hstack([self._tensor(f"lstm{name}.weight_ih_l{k}", (512, inputs)),
                                self._tensor(f"lstm{name}.weight_hh_l{k}", (512, 128))])
            layers.append((joined.T, self._tensor(f"lstm{name}.bias_ih_l{k}", (512,)) +
                           self._tensor(f"lstm{name}.bias_hh_l{k}", (512,))))
        return (coordinates, layers, self._tensor(f"conv1_{name}.weight", (1, 1, 3)).ravel(),
                self._tensor(f"conv1_{name}.bias", (1,)))

    def __call__(self, joints):
        """(features (N, 128), actions (N,)) of joints (N, T, 22, 3) in the canonical frame, meters."""
        if not np.isfinite(joints).all():
            raise holdfast.Error("joints: are not finite numbers. Use weights whose training did not diverge")
        y = np.zeros((len(joints), 128), np.float32)

        def sigmoid(x):
            return 0.5 * np.tanh(0.5 * x) + 0.5

        for coordinates, layers, kernel, bias in self.planes:
            seen = joints[..., coordinates].reshape(*joints.shape[:2], 44).astype(np.float32)
            outputs = [np.zeros_like(y), np.zeros_like(y)]
            cells = [np.zeros_like(y), np.zeros_like(y)]
            for t in range(joints.shape[1]):
                below = seen[:, t]
                for k, (weight, offset) in enumerate(layers):
                    gates = np.hstack([below, outputs[k]]) @ weight + offset
                    i, f, g, o = np.split(gates, 4, axis=1)
                    cells[k] = sigmoid(f) * cells[k] + sigmoid(i) * np.tanh(g)
                    below = outputs[k] = sigmoid(o) * np.tanh(cells[k])
            padded = np.pad(below, ((0, 0), (1, 1)))
            y += bias + sum(kernel[k] * padded[:, k:k + 128] for k in range(3))
        return np.float32(0.1) * np.tanh(y), (y @ self.weight.T + self.bias).argmax(1)


# --- Measures of one motion: joints (T, 22, 3) of key frames against those of the clip ---

def mean_joint_error(motion, reference):
    """MPJPE, meters."""
    return float(np.linalg.norm(motion - reference, axis=2).mean())


def variance_error_of_code(motion, reference):
    """AVE as the authors' code has it: per joint s = (S - S / (3 T))^2 / (T - 1), S the sum of all its
    coordinates; ||s - s'|| over joints. No variance: it grows with where the motion is."""
    def spread(joints):
        return (joints.sum((0, 2)) - joints.mean((0, 2)))**2 / (len(joints) - 1)
    return float(np.linalg.norm(spread(motion) - spread(reference)))


def variance_error(motion, reference):
    """AVE as it is defined (Ghosh et al. 2021): per joint the variance of its place, m^2."""
    def spread(joints):
        return ((joints - joints.mean(0))**2).sum((0, 2)) / (len(joints) - 1)
    return float(np.linalg.norm(spread(motion) - spread(reference)))


def face_error(object_, reference):
    """How near the object comes to where the reference brings it to the face, meters: both (T, 3) as
    the head has them. None where the reference brings it no nearer than 0.25 m, or not 0.1 m nearer
    than in the last key frame given."""
    distance = np.linalg.norm(reference[HISTORY:], axis=1)
    nearest = distance.argmin()
    if (distance[nearest] > AT_FACE_M or
            distance[nearest] > np.linalg.norm(reference[HISTORY - 1]) - NEARER_M):
        return None
    return float(np.linalg.norm(object_[HISTORY:] - reference[HISTORY + nearest], axis=1).min())


# --- Measures of sets: features (N, 128) ---

def frechet_of_code(features, reference):
    """'FID' of the authors' code, a mean over single pairs: ||f - f'||^2 + (s - s')^2, s the deviation
    of a motion's 128 numbers."""
    features, reference = features.astype(float), reference.astype(float)
    spread = features.std(1, ddof=1) - reference.std(1, ddof=1)
    return float((((features - reference)**2).sum(1) + spread**2).mean())


def frechet(features, reference):
    """Frechet distance of the Gaussians of two sets (Heusel et al. 2017). Biased upwards for small
    sets: compare sets of one size only."""
    a, b = features.astype(float), reference.astype(float)
    of_a, of_b = np.cov(a, rowvar=False), np.cov(b, rowvar=False)
    values, vectors = np.linalg.eigh(of_a)
    root = (vectors * np.sqrt(values.clip(0.0))) @ vectors.T
    shared = np.sqrt(np.linalg.eigvalsh(root @ of_b @ root).clip(0.0)).sum()
    off = a.mean(0) - b.mean(0)
    return max(0.0, float(off @ off + np.trace(of_a) + np.trace(of_b) - 2.0 * shared))


def frechet_of_halves(features, seed):
    """Frechet distance between two random halves of a set: the level of chance."""
    order = list(range(len(features)))
    for n, draw in zip(range(len(order) - 1, 0, -1), _study.uniforms(len(order), seed, 1)):
        k = int(draw * (n + 1))
        order[n], order[k] = order[k], order[n]
    half = len(order) // 2
    return frechet(features[order[:half]], features[order[half:2 * half]])


def distances(features):
    """(N, N) distances of all pairs."""
    return np.array([np.linalg.norm((features - one).astype(float), axis=1) for one in features])


def diversity_of_code(apart, seed):
    """Mean distance of 200 random pairs, a motion being paired with itself by chance."""
    pairs = (_study.uniforms(400, seed) * len(apart)).astype(int).reshape(200, 2)
    return float(apart[pairs[:, 0], pairs[:, 1]].mean())


def diversity(apart):
    """Mean distance of all pairs of two different motions (Guo et al. 2020)."""
    return float(apart.sum() / (len(apart) * (len(apart) - 1)))


def multimodality_of_code(apart, recognized, seed):
    """Random pairs of one recognized action, up to 20 of each, at most 10,001 draws; the sum over
    20 x 29, so that actions that never occur count as zero."""
    of_label = {label: np.flatnonzero(recognized == label) for label in set(recognized.tolist())}
    left = dict.fromkeys(of_label, 20)
    draws = iter(_study.uniforms(10_001 + 20 * NUM_ACTIONS, seed))
    total = 0.0
    for _ in range(10_001):
        first = int(next(draws) * len(apart))
        label = int(recognized[first])
        if left[label]:
            left[label] -= 1
            others = of_label[label]
            total += apart[first, others[int(next(draws) * len(others))]]
    return float(total / (20 * NUM_ACTIONS))


def multimodality(apart, labels):
    """Mean distance of two different motions of one action asked for, averaged over actions; None
    where none has two."""
    means = []
    for label in np.unique(labels):
        some = np.flatnonzero(labels == label)
        if len(some) > 1:
            means.append(diversity(apart[np.ix_(some, some)]))
    return float(np.mean(means)) if means else None


def over_repeats(values):
    """Mean with half its 95 % interval, 1.96 s / sqrt(n)."""
    count = len(values)
    interval = 1.96 * float(np.std(values, ddof=1)) / math.sqrt(count) if count > 1 else 0.0
    return {"mean": float(np.mean(values)), "interval_95": interval, "repeats": count}


# --- What processes compute ---

@functools.lru_cache(maxsize=1)
def recognizer_of(path):
    return Recognizer(path)


def still(case):
    """The last given key frame for all that follow: a baseline that knows nothing of actions."""
    keys = case.keys
    for track in (keys.poses, keys.trans, keys.object.trans, keys.object.orient):
        track[HISTORY:] = track[HISTORY - 1]
    return keys


def measure_block(part):
    """Cases of one row and repeat, generated and measured."""
    joints, measured = [], []
    for path, index in zip(part["paths"], part["indices"]):
        case = holdfast.action_case(path, key_frames=part["key_frames"])
        first = part["repeat"] == 0
        whole = first and index in part["object_cases"]
        made = {"keys": case.keys, "clip": None, "seconds": 0.0, "finishing_seconds": 0.0}
        if part["weights"] is not None:
            made = case.generate(part["mode"], weights=part["weights"], seed=part["seed"],
                                 stream=part["repeat"] * part["total"] + index,
                                 stroke_seed=part["seed"] + index, sigma=part["sigma"], finish=whole)
        elif part["row"] == "still":
            made["keys"] = still(case)
        elif part["row"] == "clip":
            made["clip"] = case.clip
        keys = made["keys"]
        here, there = case.joints(keys), case.joints(case.keys)
        joints.append(here)
        scores = {}
        if whole:
            clip = made["clip"] or case.in_motion(keys)
            scores = case.score(clip)
            if part["keep"]:
                folder = pathlib.Path(part["keep"]) / case.subject
                folder.mkdir(parents=True, exist_ok=True)
                mesh = pathlib.Path(path).parent / clip.object.mesh
                if mesh.exists():
                    clip.object.mesh = str(mesh.resolve())
                clip.save(folder / f"{case.name}.npz", force=True)
        measured.append({
            "mpjpe": mean_joint_error(here, there), "ave_code": variance_error_of_code(here, there),
            "ave": variance_error(here, there),
            "face": face_error(case.object_from_head(keys), case.object_from_head(case.keys)),
            "objects": [scores.get(key) for key in OBJECT_KEYS],
            "seconds": [made["seconds"], made["finishing_seconds"]]})
    features, actions = recognizer_of(part["recognizer"])(np.array(joints))
    for one, feature, action in zip(measured, features, actions):
        one["features"] = [float(f"{number:.9g}") for number in feature]  # float32 and back
        one["action"] = int(action)
    return measured


# --- Rows ---

class Row:
    """What stands in a row: real motion, its clips, held still, a network, or a mean of several."""

    def __init__(self, key, label, mode=None, weights=None, mean=False):
        self.key, self.label, self.mode, self.weights, self.mean = key, label, mode, weights, mean
        self.name = key.partition("@")[0]
        self.generated = weights is not None

    def summarize(self, samples, real, labels, options):
        """Over all repeats; what does not vary is not repeated but for random draws of pairs."""
        features = [np.array([one["features"] for one in sample], np.float32) for sample in samples]
        actions = [np.array([one["action"] for one in sample]) for sample in samples]
        apart = [distances(one) for one in features]
        truth = np.array([one["features"] for one in real], np.float32)
        labels = np.array(labels)
        made = range(len(samples))
        draws = range(len(samples) if self.generated else options.repeats)
        seed = options.seed * 1_000_003

        def at(repeat):
            return min(repeat, len(samples) - 1)

        s = dict.fromkeys(("mpjpe_m", "ave_code", "ave_m2", "fid_code", "fid", "face_m",
                           "multimodality", "diversity"))
        s["accuracy"] = over_repeats([float((actions[r] == labels).mean()) for r in made])
        s["diversity_code"] = over_repeats([diversity_of_code(apart[at(r)], seed + r) for r in draws])
        s["multimodality_code"] = over_repeats(
            [multimodality_of_code(apart[at(r)], actions[at(r)], seed + r) for r in draws])
        if len(labels) >= 4:
            s["diversity"] = over_repeats([diversity(apart[r]) for r in made])
            if multimodality(apart[0], labels) is not None:
                s["multimodality"] = over_repeats([multimodality(apart[r], labels) for r in made])
            s["fid"] = over_repeats(
                [frechet_of_halves(truth, seed + r) for r in range(options.repeats)]
                if self.key == "real" else [frechet(features[r], truth) for r in made])
        if self.generated or self.key == "still":
            for name, key in (("mpjpe_m", "mpjpe"), ("ave_code", "ave_code"), ("ave_m2", "ave")):
                s[name] = over_repeats([float(np.mean([one[key] for one in sample]))
                                        for sample in samples])
            s["fid_code"] = over_repeats([frechet_of_code(features[r], truth) for r in made])
            # Given objects come to faces by themselves.
            at_face = [[one["face"] for one in sample if one["face"] is not None] for sample in samples]
            if at_face[0] and (self.key == "still" or self.mode != "given"):
                s["face_m"] = over_repeats([float(np.mean(some)) for some in at_face])
        s["by_action"] = {
            int(action): {"sequences": int((labels == action).sum()), "accuracy_ratio": float(np.mean(
                [one[labels == action] == action for one in actions]))} for action in np.unique(labels)}
        s["objects"] = {}
        for k, key in enumerate(OBJECT_KEYS):
            some = [one["objects"][k] for one in samples[0] if one["objects"][k] is not None]
            pick = np.median if key.startswith("jitter_") else np.mean
            s["objects"][key] = float(pick(some)) if some else None
        for k, name in enumerate(("seconds", "finishing_seconds")):
            some = [one["seconds"][k] for one in samples[0] if one["seconds"][k] > 0]
            s[name] = float(np.median(some)) if some else 0.0
        self.summary = s


def means_over_seeds(rows):
    """A row for every name that has several networks (NAME, NAME@2, ...) with one mode: the means of
    their means, with 95 % intervals of the seeds of their trainings."""
    groups = {}
    for row in rows:
        if row.generated:
            groups.setdefault((row.mode, row.name), []).append(row)
    means = []
    for (mode, name), some in groups.items():
        if len(some) < 2:
            continue
        mean = Row(name, f"{LABELS.get(name, name)}, mean of {len(some)} seeds", mode, mean=True)
        first = some[0].summary
        mean.summary = {
            key: over_repeats([row.summary[key]["mean"] for row in some])
            if isinstance(value, dict) and "mean" in value else None for key, value in first.items()}
        mean.summary["objects"] = {}
        mean.summary["by_action"] = {
            action: {"sequences": one["sequences"], "accuracy_ratio": float(np.mean(
                [row.summary["by_action"][action]["accuracy_ratio"] for row in some]))}
            for action, one in first["by_action"].items()}
        means.append(mean)
    return rows + means


def order_of(rows, mode):
    """Whether the full model is better than every ablation, in sentences: means over seeds where there
    are any, else single networks; empty without both."""
    with_mean = {row.key for row in rows if row.mean}
    some = [row for row in rows if row.mode == mode and
            (row.mean or (row.generated and row.name not in with_mean))]
    full = next((row.summary for row in reversed(some) if row.name == "full"), None)
    others = [row for row in some if row.name != "full"]
    if not full or not others:
        return []
    sentences = []
    for name, key, sign in (("MPJPE", "mpjpe_m", 1), ("AVE (code)", "ave_code", 1), ("AVE", "ave_m2", 1),
                            ("FID (code)", "fid_code", 1), ("FID", "fid", 1),
                            ("accuracy", "accuracy", -1), ("object at the face", "face_m", 1)):
        best = full[key]
        if not best:
            continue
        better, even = [], []
        for other in others:
            value = other.summary[key]
            if not value:
                continue
            # By how much the full model is ahead, against what both means are known to.
            ahead = sign * (value["mean"] - best["mean"])
            known = math.hypot(value["interval_95"], best["interval_95"])
            if ahead < -known:
                better.append(other.label)
            elif ahead <= known:
                even.append(other.label)
        words = ([f"BEHIND {', '.join(better)}"] if better else []) + \
                ([f"even with {', '.join(even)}"] if even else [])
        sentences.append(f"{name}: " + ("; ".join(words) or
                                        "the full model is ahead of every ablation"))
    return sentences


# --- Tables ---

def cell(value, digits, factor=1.0):
    if not value:
        return "-"
    text = f"{factor * value['mean']:.{digits}f}"
    return text + (f" ± {factor * value['interval_95']:.{digits}f}" if value["repeats"] > 1 else "")


def motion_table(rows, mode, published):
    """(title, about, heads, rows)"""
    heads = ["", "MPJPE, m ↓", "AVE (code) ↓" if published else "AVE, m2 ↓",
             "FID (code) ↓" if published else "FID ↓", "accuracy ↑", "diversity →", "multimodality →"]
    faces = not published and mode != "given"
    table = []
    for row in rows:
        if row.key == "clip" or row.mode not in (None, mode):
            continue
        s = row.summary
        keys = ([("mpjpe_m", 4), ("ave_code", 3), ("fid_code", 3), ("accuracy", 3), ("diversity_code", 3),
                 ("multimodality_code", 3)] if published else
                [("mpjpe_m", 4), ("ave_m2", 5), ("fid", 3), ("accuracy", 3), ("diversity", 3),
                 ("multimodality", 3)])
        table.append([row.label, *(cell(s[key], digits) for key, digits in keys),
                      *([cell(s["face_m"], 1, 100.0)] if faces else [])])
    about = PLACED[mode] + "." + (
        "" if published else " FID of real motion: between two random halves of it, of half the size "
                             "each, which is the level of chance.")
    whose = "authors' code's" if published else "field's"
    return (f"Motion, by the {whose} definitions; objects {mode}",  about,
            heads + (["object at the face, cm ↓"] if faces else []), table)


def paper_table():
    heads = ["", "MPJPE, m ↓", "AVE (code) ↓", "FID (code) ↓", "accuracy ↑", "diversity →",
             "multimodality →"]
    return ("The paper's Table 2 (GRAB), by the authors' code's definitions",
            "Other data and another action classifier: compare the order of the rows, not the numbers.", heads,
            [[label, *("-" if value is None else f"{value[0]:.2f} ± {value[1]:.3f}" for value in values)]
             for label, values in PAPER.items()])


def object_table(rows, mode):
    about = ("Clips at 30 frames per second with locked feet and added strokes, all frames fitted: the "
             "output of 'synthesize'." if mode == "fitted" else
             "Key frames interpolated by curves at 30 frames per second; fingers as in the last given frame.")
    columns = [("frames deeper than 2 mm", "deep_penetration_frames_ratio", 100.0, 1, "%"),
               ("deepest, mean", "penetration_max_mm", 1.0, 1, "mm"),
               ("frames in contact", "contact_frames_ratio", 100.0, 1, "%"),
               ("slip", "contact_slip_mm_per_frame", 1.0, 2, "mm/frame"),
               ("drift", "contact_drift_mm", 1.0, 1, "mm"),
               ("object's shake / wrist's", "jitter_acceleration_ratio", 1.0, 2, ""),
               ("turning", "jitter_angular_acceleration_ratio", 1.0, 2, ""),
               ("object's accel.", "object_acceleration_m_s2", 1.0, 2, "m/s2"),
               ("joints' accel.", "joint_acceleration_m_s2", 1.0, 2, "m/s2"),
               ("foot skating", "foot_skate_mm_per_frame", 1.0, 2, "mm/frame")]
    table = [[row.label, *(_study.fixed(None if row.summary["objects"][key] is None else
                                        factor * row.summary["objects"][key], digits, unit)
                           for _, key, factor, digits, unit in columns)]
             for row in rows if not row.mean and row.mode in (None, mode)]
    return (f"Hand and object, not measured in the paper; objects {mode}",
            about + " As 'holdfast score' measures; means over sequences, medians for shake.",
            ["", *(head for head, *_ in columns)], table)


def row_json(row, actions):
    s = row.summary
    out = {"row": row.key, "label": row.label}
    if row.mode:
        out["objects_placed"] = row.mode
    if row.mean:
        out["mean_of_seeds"] = True
    if row.generated:
        network = holdfast.synthesis_network(row.weights)
        out["config"] = network.pop("config")
        out["network"] = network
    if row.key != "clip":
        out["as_published"] = {
            "mpjpe_m": s["mpjpe_m"], "ave": s["ave_code"], "fid": s["fid_code"],
            "accuracy_ratio": s["accuracy"], "diversity": s["diversity_code"],
            "multimodality": s["multimodality_code"]}
        out["as_defined"] = {
            "mpjpe_m": s["mpjpe_m"], "ave_m2": s["ave_m2"], "fid": s["fid"], "face_m": s["face_m"],
            "accuracy_ratio": s["accuracy"], "diversity": s["diversity"],
            "multimodality": s["multimodality"]}
        out["by_action"] = {actions[action]: one for action, one in s["by_action"].items()}
    out["objects"] = s["objects"]
    return out


def draw_actions(rows, modes, actions):
    def draw(axes):
        for ax, mode in zip(axes if isinstance(axes, list) else [axes], modes):
            some = [row for row in rows if row.key != "clip" and row.mode in (None, mode)]
            for k, row in enumerate(some):
                by = row.summary["by_action"]
                ax.bar(np.arange(len(by)) + (k - 0.5 * (len(some) - 1)) * 0.8 / len(some),
                       [100 * one["accuracy_ratio"] for one in by.values()], 0.8 / len(some),
                       label=row.label)
                ax.set_xticks(range(len(by)), [actions[action] for action in by], rotation=60)
            ax.set(title=f"Recognized, by action, objects {mode}", ylabel="%", ylim=(0, 100))
            ax.legend(fontsize="x-small")
    return draw


# --- The study ---

def networks_of(told):
    """{name: file} of NAME=FILE; '' is the embedded network."""
    networks = {}
    for text in told or ["full="]:
        name, equals, file = text.partition("=")
        if not equals or not re.fullmatch(r"[A-Za-z0-9.-]+(@[A-Za-z0-9.-]+)?", name):
            raise holdfast.Error(
                f"--weights {text}: is not NAME=FILE. Give full=FILE, random-embeddings=FILE, "
                "no-attention=FILE, one-module=FILE, or a name of letters, digits, '-' and '.', "
                "followed by '@2' for seed 2 of the training")
        if name in networks or name in ("real", "clip", "still"):
            raise holdfast.Error(f"--weights {text}: '{name}' is the name of another row. Give each "
                                 "network a different name")
        holdfast.synthesis_network(file)
        networks[name] = file
    return networks


def label_of(name):
    name, _, seed = name.partition("@")
    return LABELS.get(name, name) + (f", seed {seed}" if seed else "")


def cases_of(options):
    """[(path, ActionCase)] of the held-out subjects, held in the last key frame given."""
    files = []
    for folder in map(pathlib.Path, options.data):
        if not folder.is_dir():
            raise holdfast.Error(f"{folder}: is not a folder of clips. Give a folder written by 'holdfast "
                                 "make-actions', or one of imported clips")
        files += [file for file in sorted(folder.rglob("*.npz"))
                  if "dropped" not in file.relative_to(folder).parts[:-1]]
    cases, there = [], set()
    for number, file in enumerate(files, 1):
        case = holdfast.action_case(str(file), key_frames=options.key_frames)
        _study.progress("reading clips", number, len(files))
        if case is None or case.action in options.without:
            continue
        there.add(case.subject)
        if case.subject in options.held_out:
            cases.append((str(file), case))
    if not cases:
        raise holdfast.Error(f"--held-out {','.join(options.held_out)}: no clip is of these subjects. "
                             f"Choose from {', '.join(sorted(there))}")
    if 0 < options.at_most < len(cases):
        cases = [cases[i * len(cases) // options.at_most] for i in range(options.at_most)]
    held = [(path, case) for path, case in cases
            if len(case.keys.holding_hand) and case.keys.holding_hand[HISTORY - 1]]
    if not held:
        raise holdfast.Error(f"{', '.join(options.data)}: in no held-out clip is the object held in the "
                             "last given key frame. Give clips that begin with the object in a hand")
    return held


def parts_of(row, repeats, paths, options):
    """[{part: argument of measure_block}], one dict for each repeat."""
    total = len(paths)
    some = min(options.object_cases, total)
    measured = [i for i in range(total) if i * some // total != (i + 1) * some // total]
    label = f"{row.mode}_{row.key}" if row.mode else row.key
    all_parts = []
    for repeat in range(repeats):
        size = SLOW_BLOCK if repeat == 0 or row.mode == "fitted" else FAST_BLOCK
        network = holdfast.synthesis_network(row.weights)["checksum"][:12] if row.generated else ""
        all_parts.append({
            f"{label}_{network}_{repeat:02d}_{first:04d}": {
                "row": row.key, "mode": row.mode, "weights": row.weights, "repeat": repeat,
                "paths": paths[first:first + size], "indices": list(range(total))[first:first + size],
                "total": total, "object_cases": measured, "seed": options.seed, "sigma": options.sigma,
                "key_frames": options.key_frames, "recognizer": options.recognizer,
                "keep": str(options.output / "clips" / label)
                if options.keep_clips and row.key != "clip" else None}
            for first in range(0, total, size)})
    return all_parts


def study(options):
    networks = networks_of(options.weights)
    recognizer = Recognizer(options.recognizer)
    cases = cases_of(options)
    paths, labels = [path for path, _ in cases], [case.action_id for _, case in cases]
    actions = {case.action_id: case.action for _, case in cases}
    rows = [Row("real", "real motion"), Row("clip", "real motion, all frames"),
            Row("still", "last given pose, held")]
    rows += [Row(name, label_of(name), mode, file) for mode in options.objects
             for name, file in networks.items()]
    store = _study.Store(options.output, "motions", {
        "study": "synthesis", "cases": [_study.checksum(path) for path in paths],
        "recognizer": _study.checksum(options.recognizer), "seed": options.seed, "sigma": options.sigma,
        "key_frames": options.key_frames, "object_cases": options.object_cases}, options.force)
    plan = {}
    for row in rows:
        repeats = 1 if not row.generated else (
            options.fitted_repeats if row.mode == "fitted" else options.repeats)
        plan[row] = parts_of(row, repeats, paths, options)
    results = store.run(measure_block, {name: part for all_parts in plan.values() for parts in all_parts
                                        for name, part in parts.items()}, options.jobs)
    for row, all_parts in plan.items():
        samples = [[one for name in parts for one in results[name]] for parts in all_parts]
        real = samples[0] if row.key == "real" else real
        row.summarize(samples, real, labels, options)
    rows = means_over_seeds(rows)
    write(options, recognizer, cases, actions, rows)


def write(options, recognizer, cases, actions, rows):
    known = 100 * rows[0].summary["accuracy"]["mean"]
    if known < 70:
        print(f"the action classifier recognizes {known:.0f} % of the real motions; measures based on "
              "it are not reliable")
    subjects = ", ".join(sorted({case.subject for _, case in cases}))
    notes = [
        f"{len(cases)} held-out sequences of {subjects} ({', '.join(options.data)}), 15 key frames, the "
        f"first {HISTORY} given; {options.repeats} repeats with 95 % intervals (1.96 standard errors).",
        f"Hand and object are measured in {min(options.object_cases, len(cases))} of them, evenly "
        "spread, once each.",
        f"Action classifier {options.recognizer}: recognizes {known:.1f} % of the real motion of these "
        f"sequences; held out in its training: {recognizer.notes.get('held_out', 'unknown')}, accuracy on "
        f"these: {recognizer.notes.get('accuracy, held out', 'unknown')}.",
        "Both definitions are given because the authors' code does not compute the standard measures: "
        "its AVE grows with the position of a motion, its FID is a mean of distances of single pairs, "
        "and its multimodality counts missing actions as zero. See docs/metrics.md, Synthesis.",
        "'Last given pose, held' repeats the last given key frame: a network that is not clearly better in "
        "a column has learned nothing that this measure shows."]
    tables = [motion_table(rows, mode, published) for mode in options.objects
              for published in (True, False)]
    tables += [paper_table(), *(object_table(rows, mode) for mode in options.objects)]
    text = "\n".join(f"## {title}\n\n{about}\n\n{_study.markdown(heads, table)}"
                     for title, about, heads, table in tables)
    for mode in options.objects:
        sentences = order_of(rows, mode)
        if sentences:
            text += f"\n## Order of the rows, objects {mode}\n\n"
            text += "".join(f"- {sentence}\n" for sentence in sentences)
    results = _study.head("holdfast/evaluate-synthesis/1", options.seed)
    results.update({
        "notes": notes, "data": options.data, "held_out": options.held_out,
        "key_frames": options.key_frames,
        "recognizer": {"weights": options.recognizer, "notes": recognizer.notes},
        "sequences": [f"{case.subject}/{case.name}" for _, case in cases],
        "rows": [row_json(row, actions) for row in rows],
        "paper": [{"label": label, **{key: {"mean": value[0], "interval_95": value[1]}
                                      for key, value in zip(PAPER_KEYS, values) if value}}
                  for label, values in PAPER.items()],
        "order": {mode: order_of(rows, mode) for mode in options.objects}})
    times = {f"{row.mode}_{row.key}": {"seconds_median": row.summary["seconds"],
                                       "finishing_seconds_median": row.summary["finishing_seconds"]}
             for row in rows if row.generated}
    figure = _study.figure(options.output / "actions.png", draw_actions(rows, options.objects, actions),
                           len(options.objects), size=(9, 5))
    _study.write_json(options.output / "evaluation.json", results)
    _study.write_json(options.output / "timing.json", times)
    _study.write_atomically(options.output / "evaluation.md", "\n".join(
        ["# Synthesis: motion with objects, by intent\n", *(note + "\n" for note in notes), text,
         *filter(None, [figure])]))
    print(text)
    for name, one in times.items():
        print(f"{name}: 15 key frames {1e3 * one['seconds_median']:.1f} ms, fit of all frames "
              f"{one['finishing_seconds_median']:.2f} s")


def main(arguments):
    parser = _study.parser(
        "synthesis", __doc__,
        "synthesis --data actions --held-out s9,s10 -o out/synthesis \\\n"
        "    --weights full=out/imos/best.safetensors --recognizer recognizer.safetensors")
    parser.set_defaults(seed=1)
    def listed(text):
        return text.split(",")
    parser.add_argument("--data", nargs="+", required=True,
                        help="folders of action clips, such as from 'holdfast make-actions'")
    parser.add_argument("--held-out", type=listed, default=["s10"],
                        help="subjects to evaluate, not used in training, comma-separated [s10]")
    parser.add_argument("--weights", action="append", default=[], metavar="NAME=FILE",
                        help="a row of the table; NAME is full, random-embeddings, no-attention, "
                             "one-module or your own. NAME@2=FILE: the same trained with seed 2; means "
                             "over seeds are added as rows. Without a FILE: the embedded network [full=]")
    parser.add_argument("--recognizer", required=True,
                        help="action classifier of 'holdfast train recognizer'")
    parser.add_argument("--objects", type=listed, default=["given", "fitted"],
                        help="object poses in generated motion: given (ground truth, as published), carried "
                             "(fixed to the wrist), fitted (the full pipeline) [given,fitted]")
    parser.add_argument("--without", type=listed, default=[],
                        help="actions to leave out (as published: lift)")
    parser.add_argument("--key-frames", choices=["whole", "paper"], default="whole",
                        help="15 key frames spread over the whole clip, or over the contact (paper)")
    parser.add_argument("--repeats", type=int, default=20, help="number of samples of each sequence [20]")
    parser.add_argument("--fitted-repeats", type=int, default=1,
                        help="the same with fitted objects; a later run with more reuses these [1]")
    parser.add_argument("--object-cases", type=int, default=60,
                        help="number of sequences, evenly spread, in which hand and object are measured, "
                             "with all frames fitted; takes a second each [60]")
    parser.add_argument("--at-most", type=int, default=0, help="number of sequences, evenly spread [0: all]")
    parser.add_argument("--sigma", type=float, default=1.0, help="standard deviation of the latents")
    parser.add_argument("--keep-clips", action="store_true", help="write the clips that are measured")
    options = parser.parse_args(arguments)
    if set(options.objects) - set(PLACED):
        parser.error("--objects: choose from given, carried, fitted")
    if min(options.repeats, options.fitted_repeats, options.object_cases) < 1 or options.at_most < 0:
        parser.error("--repeats, --fitted-repeats, --object-cases: 1 or more; --at-most: 0 or more")
    study(options)
    return 0
