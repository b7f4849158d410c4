# SPDX-License-Identifier: MIT
"""Training of WANDR's network (Diomataris et al. 2024): unrolled over windows of a corpus, then over
whole generated motions to random goals.

Features and steps are those of the library's rollout (generator/wandr): states are unrolled in the
loop, and gradients go through poses, features and joints."""

import copy
import dataclasses
import math

import numpy as np
import torch

import holdfast
from holdfast.train import motion, networks, run

STATE, POSE = 135, 133  # numbers of a state or delta; of a pose among the features
INTENTION = {"paper": 9, "flagged": 10, "bounded": 13}
REACH_LIMIT = 2.0  # meters, and m/s: kMaxIntention
POSITION_UNIT, FOOT_UNIT, STANDING_STEP = 0.02, 0.004, 0.005  # meters (a frame)
LEGS = (0, 1, 2, 4, 5, 7, 8, 10, 11)
LONGEST_FREE, LONGEST_LATE, AFTER_DEADLINE = 240, 308, 8  # frames
REFERENCE_LASTS, CRITIC_EVERY, LARGEST_BAR = 500, 12, 60.0


@dataclasses.dataclass
class Options:
    """How a network is trained. The paper's recipe is in published.py."""

    residual: bool = True  # or the chain of an imported network
    width: int = 256
    blocks: int = 4  # of the decoder; the encoder has half as many
    latent: int = 64
    layout: str = "bounded"
    wrist: str = "right"

    kl: float = 0.5  # weight of the divergence, of the mean over latents
    free_bits: float = 0.02  # least divergence of a latent
    position: float = 0.3  # of joints, units of 2 cm
    foot_velocity: float = 0.06  # units of 4 mm a frame
    foot_contact: float = 0.06
    spread: float = 0.5  # factor of logvar: exp(0.5 logvar); 1 as published
    # From 4 steps on, this share of bodies is driven by latents of N(0, 1) in place of the encoder's.
    prior_share: float = 0.0

    no_goal: float = 0.1  # share of windows without a goal: a motion prior
    hindsight: float = 0.15  # with the wrist's place 0.5 to 8 s later
    deadline_error: float = 0.2  # far deadlines are wrong by up to this share
    perturbed: float = 0.5  # share of perturbed starts, by up to ...
    perturbation_rad: float = 0.15
    captured: float = 0.2  # share of windows from captured motion

    free_from: float = 0.5  # share of the iterations after which whole motions begin
    free_share: float = 0.5  # of the iterations from there on
    free_bodies: int = 64
    anchor: float = 1.0  # weight of straying from the earlier network
    critic: float = 1.0
    distance: float = 1.0  # per meter from the goal
    skating: float = 0.05  # the lowest foot slides, units of 4 mm a frame
    floor: float = 0.02  # feet below the ground, units of 2 cm
    airborne: float = 0.02  # both feet above it, units of 2 cm
    speed: float = 0.05  # faster than 1.6 m/s, units of 0.5 m/s
    ankle_m: float = 0.0  # heights of foot joints of somebody who stands
    ball_m: float = 0.0
    late: float = 0.0  # share of full rollouts with more time than walking needs, up to 10 s
    deadline: tuple = (42.0, 0.95, 40.0, 240.0)  # frames to reach, walking m/s, least, most frames

    iterations: int = 6000
    frames: int = 4096  # bodies times unrolled steps
    unroll: int = 16
    learning_rate: float = 6e-4  # of AdamW, warmed up, falling linearly ...
    decay_from: float = 0.3  # ... from this share of the iterations on
    weight_decay: float = 1e-4
    largest_gradient: float = 1.0
    average_rate: float = 0.004  # of the running average, which is what is kept
    seed: int = 1


def rho(squared):
    return 18.0 * (torch.sqrt(1.0 + squared / 9.0) - 1.0)


def block_means(squared):
    """(3, N): means over translation, root and joints of rows of squared errors of deltas (N, 135)."""
    return torch.stack([part.mean(1) for part in squared.split((3, 6, STATE - 9), 1)])


def robust_error(e, unit):
    """rho of an error (..., 3) in units, the mean over coordinates inside."""
    return rho((e * e).sum(-1) / (3.0 * unit * unit))


class Norms:
    """Statistics as the loop uses them: x_norm = (x - mean) / (deviation + 1e-5)."""

    def __init__(self, statistics, device):
        self.tensors = {name: torch.as_tensor(values) for name, values in statistics.items()}

        def joined(*features):
            mean, std = (torch.cat([self.tensors[f"statistics.{f}.{what}"] for f in features]).double()
                         for what in ("mean", "std"))
            return mean.float().to(device), (std + 1e-5).float().to(device)

        mean, scale = joined("body_transl", "body_orient_xy", "body_pose")
        self.pose_mean, self.pose_scale = mean[2:], 1.0 / scale[2:]
        self.delta_mean, self.delta_scale = joined(
            "body_transl_delta_pelv_xy", "body_orient_delta", "body_pose_delta")

    def normalized(self, delta):
        return (delta - self.delta_mean) / self.delta_scale


class Pose:
    """N bodies: SMPL-X translations (N, 3) and rotations (N, 22, 3, 3)."""

    def __init__(self, transl, rotations):
        self.transl, self.rotations = transl, rotations

    @staticmethod
    def of_states(states):
        return Pose(states[..., :3], motion.rotations_of(states[..., 3:].unflatten(-1, (22, 6))))

    def state(self):
        return torch.cat((self.transl, motion.six_of(self.rotations).flatten(-2)), -1)

    def detach(self):
        return Pose(self.transl.detach(), self.rotations.detach())

    def delta_to(self, other):
        """The delta between two poses."""
        heading = motion.heading_of(self.rotations[:, 0])
        change = self.rotations.transpose(2, 3) @ other.rotations
        return torch.cat((motion.to_heading(heading, other.transl - self.transl),
                          motion.six_of(change).flatten(1)), 1)

    def moved(self, delta):
        """s' = step(s, d)."""
        heading = motion.heading_of(self.rotations[:, 0])
        change = motion.rotations_of(delta[:, 3:].unflatten(1, (22, 6)))
        product = motion.rotations_of(motion.six_of(self.rotations @ change))
        return Pose(self.transl + motion.to_world(heading, delta[:, :3]), product)


class Cut(torch.autograd.Function):
    """Identity on a pose; clips the gradient's tangent of each body to norm `largest`, because over
    hundreds of steps those of few bodies dominate. A non-finite gradient becomes 0."""

    @staticmethod
    def forward(context, transl, rotations, largest):
        context.save_for_backward(rotations)
        context.largest = largest
        return transl.clone(), rotations.clone()

    @staticmethod
    def backward(context, transl_bar, rotations_bar):
        rotations, = context.saved_tensors
        turn = rotations.transpose(2, 3) @ rotations_bar
        skew = turn - turn.transpose(2, 3)
        phi = torch.stack((skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]), -1)
        norm = torch.sqrt((transl_bar ** 2).sum(1) + (phi ** 2).sum((1, 2)))
        factor = torch.clamp(context.largest / norm.clamp_min(1e-30), max=1.0)
        finite = torch.isfinite(norm)
        keep = lambda bar, shape: torch.where(finite.view(shape), bar * factor.view(shape), torch.zeros_like(bar))
        return keep(transl_bar, (-1, 1)), keep(rotations_bar, (-1, 1, 1, 1)), None


def _saturating(e):
    """D (1 - exp(-|e|)) along e."""
    n = torch.sqrt((e * e).sum(1, keepdim=True).clamp_min(1e-12))
    return -REACH_LIMIT * torch.expm1(-n) / n * e


def intention_of(layout, heading, pelvis, wrist, goal, eta, active, facing=None):
    """I of intention.h: goal (N, 3), eta frames left (N, 1), active (N, 1) 1 with a goal; facing (N, 2):
    the heading to take, in place of the direction to the goal."""
    reach, way = goal - wrist, goal - pelvis
    velocity = motion.to_heading(heading, reach / (eta / 30.0 + 1e-5))
    walk = motion.to_heading(heading, _saturating(way))[:, :2]
    squared = (way[:, :2] ** 2).sum(1, keepdim=True)
    wanted = torch.cat((way[:, :2] / torch.sqrt(squared.clamp_min(1e-12)), torch.zeros_like(eta)), 1)
    turn = motion.to_heading(heading, wanted)[:, :2] + torch.tensor([0.0, 1.0]).to(way)
    turn = torch.where(squared < 1e-12, torch.zeros_like(turn), turn)
    if facing is not None:
        turn = motion.to_heading(heading, torch.cat((facing, torch.zeros_like(eta)), 1))[:, :2]
        turn = turn + torch.tensor([0.0, 1.0]).to(way)
    zero, one = torch.zeros_like(eta), torch.ones_like(eta)
    if layout == "bounded":
        n = torch.sqrt((velocity * velocity).sum(1, keepdim=True).clamp_min(1e-12))
        limited = REACH_LIMIT * torch.tanh(n / REACH_LIMIT) / n * velocity
        parts = (limited, motion.to_heading(heading, _saturating(reach)), walk, turn,
                 torch.exp(-eta / 30.0), torch.exp(-eta / 8.0), one)
    else:
        parts = (velocity, walk, zero, turn, zero) + ((one,) if layout == "flagged" else ())
    return torch.cat(parts, 1) * active


class Windows:
    """Windows of motion that a network is unrolled over: truth (A + 1, or 1 where free), the
    delta that led to the start, normalized (N, 135), and for each step goal (A, N, 3), eta (A, N, 1)
    and whether there is one (A, N, 1)."""

    def __init__(self, truth, delta, goal, eta, active):
        self.truth, self.delta, self.goal, self.eta, self.active = truth, delta, goal, eta, active


class Corpus:
    """Training motion on one device, and random windows of it.

    `clips` as from _read_corpus. Frames of all clips are concatenated."""

    def __init__(self, clips, bones, norms, options, device):
        self.bones, self.norms, self.options, self.device = bones, norms, options, device
        lengths = np.array([len(states) for states, *_ in clips])
        self.start = np.concatenate(([0], np.cumsum(lengths)[:-1]))
        self.length = lengths
        self.states = torch.from_numpy(np.concatenate([states for states, *_ in clips])).to(device)
        self.goals = np.concatenate([goals for _, goals, *_ in clips])
        self.due = np.concatenate([start + due for start, (_, _, due, _) in zip(self.start, clips)])
        self.clip_of_goal = np.repeat(np.arange(len(clips)), [len(due) for *_, due, _ in clips])
        made = np.array([made for *_, made in clips])
        self.groups = {True: np.flatnonzero(~made), False: np.flatnonzero(made)}  # by captured
        self.wrist = motion.RIGHT_WRIST if options.wrist == "right" else motion.LEFT_WRIST

    def draw_frames(self, steps, count, draws):
        """Random clips, weighted by length, and frames of them followed by `steps` + 1: (clips, frames)."""
        captured = draws.random(count) < self.options.captured
        if not len(self.groups[False]) or not len(self.groups[True]):
            captured[:] = not len(self.groups[False])
        clips = np.empty(count, int)
        for which, group in self.groups.items():
            long = group[self.length[group] >= steps + 2]
            mask = captured == which
            if mask.any():
                if not len(long):
                    raise holdfast.Error(f"corpus: no clip has {steps + 2} frames. Give a smaller --unroll")
                ends = np.cumsum(self.length[long])
                clips[mask] = long[np.searchsorted(ends, draws.random(mask.sum()) * ends[-1], side="right")]
        return clips, (draws.random(count) * (self.length[clips] - steps)).astype(int)

    def draw_goals(self, clips, frames, steps, draws):
        """Goal, eta and whether there is one at each step, by Options' mixture; clips without
        labeled goals ahead use hindsight goals instead."""
        o, count = self.options, len(clips)
        kind, when, error = draws.random((3, count))
        at = self.start[clips] + frames
        next_goal = np.searchsorted(self.due, at, side="right")
        ends = np.searchsorted(self.clip_of_goal, clips, side="right")
        labeled = (next_goal < ends) & (kind >= o.no_goal + o.hindsight)
        last = np.minimum(frames + 240, self.length[clips] - 1)
        first = np.minimum(frames + 15, last)
        seen = first + (when * (last - first + 1)).astype(int)
        hindsight = (kind >= o.no_goal) & ~labeled & (last > frames)
        pose = Pose.of_states(self.states[torch.from_numpy(self.start[clips] + seen).to(self.device)])
        places = motion.wrist_position(pose.rotations, pose.transl, self.bones, self.wrist).cpu().numpy()
        goal, eta = np.zeros((steps, count, 3), np.float32), np.ones((steps, count), np.float32)
        active = np.zeros((steps, count), bool)

        # The first labeled goal's deadline is told wrongly where it is far; later ones rightly.
        k = np.minimum(next_goal, max(len(self.due) - 1, 0))
        due = self.due[k] - at if len(self.due) else np.zeros(count, int)
        spare = due - 30.0
        shift = np.where(spare > 0, np.rint(spare * o.deadline_error * (2.0 * error - 1.0)), 0).astype(int)
        second = next_goal + 1 < ends
        k2 = np.minimum(next_goal + 1, max(len(self.due) - 1, 0))
        told = due + shift
        if len(self.due):
            told = np.where(second & (spare > 0), np.minimum(told, self.due[k2] - at - 1), told)
        for a in range(steps):
            index = np.maximum(next_goal + 1, np.searchsorted(self.due, at + a, side="right"))
            index = np.where(told > a, next_goal, index)
            there = labeled & (index < ends)
            if there.any():
                some = index[there]
                goal[a, there] = self.goals[some]
                eta[a, there] = np.where(some == next_goal[there], told[there], self.due[some] - at[there]) - a
            there = hindsight & (seen - frames > a)
            goal[a, there], eta[a, there] = places[there], (seen - frames - a)[there]
            active[a] = (labeled & (index < ends)) | there
        return goal, np.maximum(eta, 1.0)[..., None], active[..., None].astype(np.float32)

    def draw_perturbations(self, count, draws):
        """Tangents at the start (N, 23, 3): the translation's height and each joint's turn."""
        o = self.options
        size = o.perturbation_rad * draws.random(count) * (draws.random(count) < o.perturbed)
        tangent = draws.standard_normal((count, 23, 3)) * size[:, None, None]
        tangent[:, 0] *= 0.15  # meters the body is too high or low, per radian
        tangent[:, 0, :2] = 0.0
        tangent[:, [1 + joint for joint in LEGS]] *= 0.5
        return torch.from_numpy(tangent.astype(np.float32)).to(self.device)

    def poses(self, indices):
        return Pose.of_states(self.states[torch.from_numpy(indices).to(self.device)])

    def windows(self, clips, frames, steps, goals, perturbation=None):
        """Windows at these frames; a perturbed start is blended back to the data within about 8 frames."""
        at = self.start[clips] + frames

        def perturbed(pose, frame):
            if perturbation is None:
                return pose
            tangent = math.exp(-frame / 8.0) * perturbation
            return Pose(pose.transl + tangent[:, 0], pose.rotations @ motion.exponential(tangent[:, 1:]))

        truth = [perturbed(self.poses(at + a), a) for a in range(steps + 1)]
        rest = torch.tensor([0.0] * 3 + [1.0, 0.0, 0.0, 0.0, 1.0, 0.0] * 22, device=self.device)
        led_here = perturbed(self.poses(np.maximum(at - 1, 0)), -1).delta_to(truth[0])
        begins = torch.from_numpy(frames == 0).to(self.device).unsqueeze(1)
        delta = self.norms.normalized(torch.where(begins, rest, led_here))
        return Windows(truth, delta, *(torch.from_numpy(x).to(self.device) for x in goals))

    def draw(self, steps, count, draws):
        clips, frames = self.draw_frames(steps, count, draws)
        goals = self.draw_goals(clips, frames, steps, draws)
        return self.windows(clips, frames, steps, goals, self.draw_perturbations(count, draws))

    def deadline(self, distance):
        reach, walking, least, most = self.options.deadline
        return np.rint(np.clip(reach + 30.0 * distance / walking, least, most))

    def draw_free(self, draws):
        """Windows for free rollouts to random goals at similar distances, so that all take about as
        long. Returns (windows, goal (N, 3), deadline (N,))."""
        o = self.options
        about, clips, frames = draws.random() * 5.2, [], []
        while sum(map(len, clips)) < o.free_bodies:
            some, at = self.draw_frames(1, o.free_bodies, draws)
            heights = self.states[torch.from_numpy(self.start[some] + at).to(self.device), 2] + self.bones[0, 0, 2]
            high = (heights >= 0.7).cpu().numpy()
            clips.append(some[high])
            frames.append(at[high])
        clips, frames = np.concatenate(clips)[: o.free_bodies], np.concatenate(frames)[: o.free_bodies]
        u = draws.random((4, o.free_bodies))
        distance = np.clip(about + 0.5 * (u[0] - 0.5), 0.25, 5.2)
        due = (1.0 + o.deadline_error * (u[2] - 0.5)) * self.deadline(distance)
        due, latest = np.minimum(due, LONGEST_FREE - AFTER_DEADLINE), LONGEST_LATE - AFTER_DEADLINE
        if o.late and draws.random() < o.late:
            due += draws.random(o.free_bodies) * (latest - due)
        due = np.rint(due).astype(int)
        pelvis = (self.poses(self.start[clips] + frames).transl + self.bones[:, 0]).cpu().numpy()
        angle = 2.0 * np.pi * u[1]
        goal = np.stack((pelvis[:, 0] + distance * np.cos(angle), pelvis[:, 1] + distance * np.sin(angle),
                         1.9 * u[3]), 1).astype(np.float32)
        windows = self.windows(clips, frames, 0, free_goals(goal, due))
        return windows, torch.from_numpy(goal).to(self.device), torch.from_numpy(due).to(self.device)


def free_goals(goal, due):
    """Goal, eta and presence of each step of free motions: as at run time the goal stays active,
    with at least a third of a second left."""
    steps = int(due.max()) + AFTER_DEADLINE
    eta = np.maximum(due[None] - np.arange(steps)[:, None], 10.0).astype(np.float32)
    return np.broadcast_to(goal, (steps, *goal.shape)).copy(), eta[..., None], np.ones_like(eta)[..., None]


class Loop:
    """The closed loop: conditions, steps and losses of bodies moved by a network."""

    def __init__(self, norms, bones, options):
        self.norms, self.bones, self.options = norms, bones, options
        self.wrist = motion.RIGHT_WRIST if options.wrist == "right" else motion.LEFT_WRIST

    def condition(self, pose, delta, goal, eta, active, facing=None):
        """The condition of the network (N, 268 + intention), normalized."""
        root = pose.rotations[:, 0]
        heading = c, s = motion.heading_of(root)
        x = c * root[:, 0] + s * root[:, 1]
        y = (c * root[:, 1] - s * root[:, 0])[:, 1:]  # its first entry is always 0
        features = torch.cat((pose.transl[:, 2:], x, torch.zeros_like(c), y,
                              motion.six_of(pose.rotations[:, 1:]).flatten(1)), 1)
        features = (features - self.norms.pose_mean) * self.norms.pose_scale
        pelvis = pose.transl + self.bones[:, 0]
        wrist = motion.wrist_position(pose.rotations, pose.transl, self.bones, self.wrist)
        told = intention_of(self.options.layout, heading, pelvis, wrist, goal, eta, active, facing)
        return torch.cat((features, delta, told), 1)

    def target(self, pose, truth):
        """The corrective delta, normalized, that moves the body to the next frame of the ground truth."""
        return self.norms.normalized(pose.detach().delta_to(truth))

    def step(self, pose, output):
        return pose.moved(output * self.norms.delta_scale + self.norms.delta_mean)

    def joints(self, poses):
        """Joints (A, N, 22, 3) of A poses of N bodies."""
        transl, rotations = (torch.stack(x) for x in zip(*((p.transl, p.rotations) for p in poses)))
        joints, _ = motion.forward_joints(rotations.flatten(0, 1), transl.flatten(0, 1), self.bones)
        return joints.unflatten(0, transl.shape[:2])

    def delta_errors(self, deltas, targets):
        """Sums over rows of the deltas' errors, means of their blocks: translation, root, joints."""
        return block_means(rho((deltas - targets).square())).sum(1)

    def joint_loss(self, joints, truth):
        """Loss of joints (A + 1, N, 22, 3) in addition to the deltas, a mean over bodies and steps."""
        o, share = self.options, 1.0 / (joints.shape[1] * (joints.shape[0] - 1))
        loss = o.position * robust_error(joints[1:] - truth[1:], POSITION_UNIT).mean(-1).sum()
        if o.foot_velocity or o.foot_contact:
            feet = list(motion.FEET)
            moved, truly = joints[1:, :, feet] - joints[:-1, :, feet], truth[1:, :, feet] - truth[:-1, :, feet]
            stands = (truly[..., :2] ** 2).sum(-1) < STANDING_STEP**2
            flat = moved * torch.tensor([1.0, 1.0, 0.0]).to(moved)
            loss = loss + o.foot_velocity * robust_error(moved - truly, FOOT_UNIT).mean(-1).sum()
            loss = loss + o.foot_contact * (stands * robust_error(flat, FOOT_UNIT)).mean(-1).sum()
        return share * loss

    def goal_loss(self, joints, goal, due):
        """Loss of whole motions, joints (T + 1, N, 22, 3), on their way to goals: the distance is a
        soft minimum over the frames from 20 before the deadline on, of weights
        softmax(-d^2 / (0.2 m)^2) taken as constant; the rest are means over frames. A mean over bodies."""
        o, last = self.options, joints.shape[0] - 1
        frame = torch.arange(last + 1, device=joints.device).unsqueeze(1)
        squared = ((joints[:, :, self.wrist] - goal) ** 2).sum(-1)
        counts = frame >= (due - 20).clamp(1, last)
        share = torch.softmax(torch.where(counts, -squared.detach() / 0.04, torch.full_like(squared, -math.inf)), 0)
        loss = o.distance * (share * torch.sqrt(squared + 0.03**2)).sum(0)

        def hinge(units):
            u = units.clamp_min(0.0)
            return torch.where(u < 3.0, 0.5 * u * u, 3.0 * (u - 1.5))

        def length(step):
            return torch.sqrt((step[..., :2] ** 2).sum(-1).clamp_min(1e-20))

        feet = joints[1:, :, list(motion.FEET)]
        standing = torch.tensor([o.ankle_m, o.ankle_m, o.ball_m, o.ball_m]).to(joints)
        height = feet[..., 2] - standing
        lowest = height.argmin(2, keepdim=True)
        rest = o.floor * hinge(-height / 0.02).sum(2)
        rest = rest + o.airborne * hinge((height.gather(2, lowest)[..., 0] - 0.05) / 0.02)
        steps = (joints[1:] - joints[:-1])
        slide = length(steps[:, :, list(motion.FEET)]).gather(2, lowest)[..., 0]
        rest = rest + o.skating * hinge((slide - 0.004) / 0.004)
        rest = rest + o.speed * hinge((length(steps[:, :, 0]) - 1.6 / 30.0) / (0.5 / 30.0))
        return (loss + rest.sum(0) / last).mean()


class Trainer:
    FORMAT, EVALUATION = "wandr-training-3", "reach"

    def __init__(self, corpus, held_out, norms, bones, options, device, start=None, body=None):
        """`corpus` and `held_out` (may be None) are Corpus; `start` ({name: tensor}, with decoder.*
        and encoder.*) weights to begin with, else random ones of the seed."""
        o = self.options = options
        self.corpus, self.held_out, self.norms, self.device, self.body = corpus, held_out, norms, device, body
        self.loop = Loop(norms, bones, o)
        core, condition = holdfast._core, POSE + STATE + INTENTION[o.layout]

        def begin(input, latent, blocks, output, seed):
            if not o.residual:
                return core._random_chain(input, output, seed)
            return core._random_residual(input, latent, o.width, blocks, output, seed)

        decoder = networks.under(start, "decoder") if start else begin(
            condition + o.latent, o.latent, o.blocks, STATE, 2 * o.seed)
        encoder = networks.under(start, "encoder") if start else {}
        encoder = encoder or begin(
            condition + STATE, 0, max(1, o.blocks // 2), 2 * o.latent, 2 * o.seed + 1)
        self.decoder, self.encoder = (networks.network_of(x).to(device) for x in (decoder, encoder))
        self.mean_decoder, self.mean_encoder = map(frozen, (self.decoder, self.encoder))
        self.reference, self.reference_since = None, 0
        self.critic = networks.Critic(networks.network_of(core._random_residual(
            POSE + 2 * STATE, 0, 128, 2, 1, o.seed)).to(device), 2e-4)
        self.parameters = [*self.decoder.parameters(), *self.encoder.parameters()]
        self.optimizer = torch.optim.AdamW(self.parameters, lr=o.learning_rate, betas=(0.9, 0.99),
                                           weight_decay=o.weight_decay)
        self.iteration, self.iterations = 0, o.iterations

    @property
    def progress(self):
        return self.iteration / max(self.iterations, 1)

    def step(self):
        o = self.options
        draws, noise = run.random_of(o.seed, self.iteration)
        torch.manual_seed(int(draws.integers(2**63)))
        rate = o.learning_rate * min(1.0, (self.iteration + 1) / 100)
        if self.progress > o.decay_from:
            rate *= 0.02 + 0.98 * (1.0 - self.progress) / (1.0 - o.decay_from)
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        for parameter in self.parameters:  # not None: the encoder goes on by its moments in free motions
            parameter.grad = torch.zeros_like(parameter)
        free = self.progress >= o.free_from and draws.random() < o.free_share
        if free:
            if self.reference is None or self.iteration - self.reference_since >= REFERENCE_LASTS:
                self.reference, self.reference_since = frozen(self.mean_decoder), self.iteration
            losses = self.go_freely(*self.corpus.draw_free(draws), noise, draws)
        else:
            losses = self.follow(draws, noise)
        losses["gradient"] = torch.nn.utils.clip_grad_norm_(self.parameters, o.largest_gradient).item()
        if math.isfinite(losses["total"]) and math.isfinite(losses["gradient"]):
            self.optimizer.step()
        # At first the average is that of the few iterations there are.
        rate = max(o.average_rate, 1.0 / (2.0 + self.iteration))
        with torch.no_grad():
            for mean, network in ((self.mean_decoder, self.decoder), (self.mean_encoder, self.encoder)):
                for average, now in zip(mean.parameters(), network.parameters()):
                    average.lerp_(now, rate)
        return ("free" if free else "train"), losses, {}

    def follow(self, draws, noise):
        """Trains on windows of the corpus: few steps first; in the end all lengths up to the longest,
        equally often."""
        o, longest, since = self.options, 1, 0.01
        while 2 * longest <= o.unroll and self.progress >= since:
            longest, since = 2 * longest, 2 * since
        steps = 1 << int(draws.random() * (longest.bit_length()))
        count = max(1, o.frames // (2 if steps == 1 else steps))
        encoded = count - round((o.prior_share if steps >= 4 else 0.0) * count)
        return self.unroll(self.corpus.draw(steps, count, draws), encoded, self.decoder, self.encoder, noise)

    def unroll(self, windows, encoded, decoder, encoder, noise, learn=True):
        """The first `encoded` bodies are driven by the encoder's latents, the others by N(0, 1)."""
        o, steps, count = self.options, len(windows.truth) - 1, len(windows.delta)
        share = 1.0 / (count * steps)
        pose, delta = windows.truth[0], windows.delta
        poses, own = [pose], 0.0
        sums, kl = torch.zeros(3, device=self.device), 0.0
        with torch.set_grad_enabled(learn):
            for a in range(steps):
                condition = self.loop.condition(pose, delta, windows.goal[a], windows.eta[a], windows.active[a])
                target = self.loop.target(pose, windows.truth[a + 1])
                z = torch.randn(count, o.latent, generator=noise).to(self.device)
                if encoded > 0:
                    code = encoder(torch.cat((target[:encoded], condition[:encoded]), 1))
                    mean, spread = code[:, : o.latent], code[:, o.latent :].clamp(-10.0, 4.0)
                    z = torch.cat((mean + z[:encoded] * torch.exp(o.spread * spread), z[encoded:]))
                    divergence = 0.5 * (mean.square() + spread.exp() - 1.0 - spread)
                    kl = kl + divergence.detach().mean() / steps
                    own = own + o.kl * share * divergence.clamp_min(o.free_bits).mean(1).sum()
                delta = decoder(torch.cat((z, condition), 1))
                errors = share * self.loop.delta_errors(delta, target)
                sums = sums + errors.detach()
                own = own + errors.sum()
                pose = self.loop.step(pose, delta)
                poses.append(pose)
                if learn:
                    pose = Pose(*Cut.apply(pose.transl, pose.rotations, math.inf))
            with torch.no_grad():
                truth = self.loop.joints(windows.truth)
            joints = self.loop.joint_loss(self.loop.joints(poses), truth)
            total = own + joints
        if learn:
            total.backward()
        return {**dict(zip(("translation", "orientation", "pose"), sums.tolist())), "kl": float(kl),
                "joints": joints.item(), "total": total.item()}

    def go_freely(self, windows, goal, due, noise, draws):
        """Trains on whole motions from prior latents to goals, with losses on the distance to the goal,
        on the deviation from an earlier state of the network, and of the critic."""
        o, count = self.options, len(goal)
        steps = len(windows.goal)
        pose, delta = windows.truth[0], windows.delta
        poses, moments, doubt = [pose], [], 0.0
        sums = torch.zeros(3, device=self.device)
        for a in range(steps):
            condition = self.loop.condition(pose, delta, windows.goal[a], windows.eta[a], windows.active[a])
            x = torch.cat((torch.randn(count, o.latent, generator=noise).to(self.device), condition), 1)
            delta = self.decoder(x)
            with torch.no_grad():
                before = self.reference(x)
            sums = sums + o.anchor / (count * steps) * self.loop.delta_errors(delta, before)
            if o.critic > 0.0:
                moment = moments_of(condition, delta)
                doubt = doubt + networks.doubt_of(self.critic.network(moment)) / steps
                if a % CRITIC_EVERY == 0:
                    moments.append(moment.detach())
            pose = self.loop.step(pose, delta)
            poses.append(pose)
            pose = Pose(*Cut.apply(pose.transl, pose.rotations, LARGEST_BAR / count))
        reached = self.loop.goal_loss(self.loop.joints(poses), goal, due)
        total = sums.sum() + o.critic * doubt + reached
        total.backward(inputs=list(self.decoder.parameters()))
        right = 0.0
        if moments:
            own = torch.cat(moments)
            right = self.learn_critic(self.true_moments(len(own), draws), own)
        return {**dict(zip(("translation", "orientation", "pose"), sums.tolist())), "goal": reached.item(),
                "doubt": float(doubt), "critic": right, "total": total.item()}

    def true_moments(self, count, draws):
        clips, frames = self.corpus.draw_frames(1, count, draws)
        goals = self.corpus.draw_goals(clips, frames, 1, draws)
        windows = self.corpus.windows(clips, frames, 1, goals)
        condition = self.loop.condition(windows.truth[0], windows.delta, *(x[0] for x in (
            windows.goal, windows.eta, windows.active)))
        return moments_of(condition, self.loop.target(*windows.truth))

    def learn_critic(self, true, own):
        real = true.detach().clone().requires_grad_()
        own_score = self.critic.network(own)
        return self.critic.learn(real, self.critic.network(real), own_score, networks.belief_of(own_score))

    def validate(self):
        """Losses of the averaged weights on clips not trained on, teacher-forced, latents encoded."""
        draws, noise = run.random_of(0, 0)
        return self.unroll(self.held_out.draw(4, 512, draws), 512, self.mean_decoder, self.mean_encoder,
                           noise, learn=False)

    def weights(self, encoder=True):
        tensors = {**self.norms.tensors, **networks.prefixed(self.mean_decoder.state_dict(), "decoder")}
        return {**tensors, **(networks.prefixed(self.mean_encoder.state_dict(), "encoder") if encoder else {})}

    def write(self, stem, notes):
        notes = {**notes, "format": "wandr-1", "intention": self.options.layout}
        networks.write_safetensors(f"{stem}.safetensors", self.weights(), notes)
        # Statistics are few, and keep their precision.
        networks.write_safetensors(f"{stem}_half.safetensors", self.weights(), notes,
                                   lambda name, tensor: not name.startswith("statistics."))

    def evaluate(self, stem):
        line = holdfast._core._evaluate_reach(f"{stem}.safetensors", body=self.body, wrist=self.options.wrist,
                                              threads=torch.get_num_threads())
        return {**line, **({"held_out": self.validate()} if self.held_out else {})}

    @staticmethod
    def is_better(now, best):
        return now["success"] >= best["success"]

    def parts(self):
        return {"decoder": self.decoder, "encoder": self.encoder, "mean.decoder": self.mean_decoder,
                "mean.encoder": self.mean_encoder, "critic": self.critic.network,
                **({"reference": self.reference} if self.reference else {})}

    def state(self):
        tensors = {f"{part}.{name}": values for part, network in self.parts().items()
                   for name, values in network.state_dict().items()}
        tensors.update(run.optimizer_tensors("adam", self.optimizer))
        tensors.update(run.optimizer_tensors("critic_adam", self.critic.optimizer))
        return tensors, {"reference_since": str(self.reference_since)}

    def load_state(self, tensors, texts):
        if networks.under(tensors, "reference"):
            self.reference = frozen(self.mean_decoder)
        for part, network in self.parts().items():
            network.load_state_dict(networks.under(tensors, part))
        run.load_optimizer("adam", tensors, self.optimizer)
        run.load_optimizer("critic_adam", tensors, self.critic.optimizer)
        self.reference_since = int(texts["reference_since"])


def frozen(network):
    """A copy that takes no gradients and drops nothing: a running average."""
    return copy.deepcopy(network).eval().requires_grad_(False)


def moments_of(condition, delta):
    """Input of the critic: the condition without the intention, and the following delta."""
    return torch.cat((condition[:, : POSE + STATE], delta), 1)


PANELS = [
    ("Goals reached, % (within 10 cm, held-out starts)", False, [("reach", "success", 100, "reached")]),
    ("Remaining distance, cm", False, [("reach", "distance_m", 100, "mean"), ("reach", "distance_median_m", 100, "median")]),
    ("Frames with a skating foot, and airborne, %", False,
     [("reach", "skating", 100, "skating"), ("reach", "airborne", 100, "airborne")]),
    ("Losses of deltas in training", True, [("train", x, 1, x) for x in ("translation", "orientation", "pose")]),
    ("Losses of deltas on held-out clips", True,
     [("reach", f"held_out.{x}", 1, x) for x in ("translation", "orientation", "pose")]),
    ("KL divergence per latent, nats; loss of joints", True, [("train", "kl", 1, "divergence"), ("train", "joints", 1, "joints")]),
    ("Whole motions to goals: loss, and deviation from the earlier network", True,
     [("free", "goal", 1, "goal"), ("free", "pose", 1, "deviation (pose)")]),
    ("Critic of whole motions: adversarial loss and accuracy", False, [("free", "doubt", 1, "loss"), ("free", "critic", 1, "accuracy")]),
]

RECIPE = ("iterations", "frames", "unroll", "learning_rate", "kl", "free_from", "free_share", "anchor", "critic",
          "prior_share", "skating", "late", "width", "blocks")
PUBLISHED = ("epochs", "batch", "intention", "motion")


def parse(arguments):
    made = run.parser("wandr", "Trains WANDR's network: human motion to goals.", [
        "wandr reaches -o out/wandr --held-out reaches/captured/held_out",
        "wandr reaches -o out/paper --paper",
        "wandr reaches -o out/again --from out/wandr/best.safetensors --iterations 250 --free-from 1"],
        "folder for best.safetensors, checkpoint, log and curves; an interrupted training resumes there")
    number = run.number
    made.add_argument("corpora", nargs="+", help="folders from 'holdfast make-reach-data', or of clips")
    made.add_argument("--held-out", help="folder of held-out clips, for the curves")
    made.add_argument("--from", dest="start", help="weights to start from, with their statistics")
    made.add_argument("--paper", action="store_true",
                      help="the paper's recipe: network, features, hindsight goals, losses, schedule and filter")
    made.add_argument("--epochs", type=number(int, 1, 1_000_000), help="--paper: epochs (default 801)")
    made.add_argument("--batch", type=number(int, 1, 1_000_000),
                      help="--paper: sequences in a batch (default 128); fewer give more steps in the same time")
    made.add_argument("--intention", choices=["full", "no-heading", "no-pelvis", "wrist"],
                      help="--paper: the parts of the intention that the network is trained with (default full)")
    made.add_argument("--motion", choices=["locomotion", "reaching", "both"],
                      help="--paper: captured locomotion, reaches with a goal, or both (default both)")
    made.add_argument("--width", type=number(int, 16, 4096), help="width of the residual network (default 256)")
    made.add_argument("--blocks", type=number(int, 1, 64),
                      help="number of blocks of the decoder; the encoder has half as many (default 4)")
    made.add_argument("--iterations", type=number(int, 1, 100_000_000), help="number of optimizer steps (default 6000)")
    made.add_argument("--frames", type=number(int, 64, 1 << 20),
                      help="frames per iteration, including unrolled frames (default 4096)")
    made.add_argument("--unroll", type=int, choices=[1, 2, 4, 8, 16, 32, 64],
                      help="longest rollout in training, frames (default 16)")
    made.add_argument("--learning-rate", type=number(float, 1e-7, 1.0), help="AdamW learning rate (default 6e-4)")
    made.add_argument("--kl", type=number(float, 0.0, 100.0),
                      help="weight of the KL divergence of the latents from N(0, 1) (default 0.5)")
    made.add_argument("--free-from", type=number(float, 0.0, 1.0),
                      help="fraction of the iterations after which full rollouts to goals are also trained "
                      "(default 0.5)")
    made.add_argument("--free-share", type=number(float, 0.0, 1.0),
                      help="fraction of full rollouts in the iterations after that (default 0.5)")
    made.add_argument("--anchor", type=number(float, 0.0, 1e6),
                      help="weight of staying near the earlier network in full rollouts (default 1)")
    made.add_argument("--critic", type=number(float, 0.0, 1e3), help="weight of the adversarial loss (default 1)")
    made.add_argument("--prior-share", type=number(float, 0.0, 1.0),
                      help="fraction of windows driven by latents from N(0, 1) instead of the encoder (default 0)")
    made.add_argument("--skating", type=number(float, 0.0, 1e3),
                      help="weight of foot skating in full rollouts (default 0.05)")
    made.add_argument("--late", type=number(float, 0.0, 1.0),
                      help="fraction of full rollouts with more time than walking needs, up to 10 s (default 0)")
    made.add_argument("--made-hours", type=number(float, 0.0, 1e6), default=1e6,
                      help="maximum hours of generated motion to use")
    made.add_argument("--wrist", choices=["right", "left"], default="right", help="wrist used for reaching")
    run.add_long(made, 250, "iterations")
    options = made.parse_args(arguments)
    run.refuse_with_paper(made, options, (*RECIPE, "start"))
    for field in PUBLISHED:
        if not options.paper and getattr(options, field) is not None:
            made.error(f"--{field} needs --paper")
    return options


def main(arguments):
    options = parse(arguments)
    device = run.prepare(options)
    body = run.body_of(options)
    rest_joints, sole_y = holdfast._core._body_measures(body)
    bones = rest_joints[:22].copy()
    bones[1:] -= rest_joints[list(motion.PARENTS[1:])]
    bones = torch.from_numpy(bones.astype(np.float32)).unsqueeze(0).to(device)
    data = holdfast._core._read_corpus(options.corpora, body=body, made_hours=options.made_hours,
                                       mirror=not options.paper, wrist=options.wrist,
                                       progress=run.reader(options))
    hours = [data[f"{kind}_frames"] / 108000.0 for kind in ("captured", "made")]
    notes = {"corpus": f"{hours[0]:.2f} h captured{'' if options.paper else ' (mirror images counted)'}, "
             f"{hours[1]:.2f} h made"}

    def go_on(trainer, recipe, what):
        run.note(options, f"{what}; {hours[0]:.2f} h captured, {hours[1]:.2f} h generated; "
                 f"{sum(x.numel() for x in trainer.parameters) / 1e6:.2f} M parameters; on {device}")
        fingerprint = (f"{dataclasses.asdict(recipe)} corpus {data['captured_frames']}+{data['made_frames']} frames in "
                       f"{len(data['clips'])} clips")
        return run.train(
            trainer, options, "wandr", fingerprint, notes, PANELS,
            lambda line: f"{100 * line['success']:.1f} % of goals reached, {100 * line['distance_m']:.1f} cm, "
                         f"skating {100 * line['skating']:.0f} %")

    if options.paper:
        from holdfast.train import published  # which builds on this module

        recipe = run.recipe(None, published.Options(wrist=options.wrist), options, PUBLISHED)
        norms = Norms(data["statistics"], device)
        train, validation, _ = published.select(data["clips"], bones, recipe)
        trainer = published.Trainer(*(published.Sequences(clips, bones, norms, recipe, device)
                                      for clips in (train, validation)), norms, bones, recipe, device, body)
        return go_on(trainer, recipe, f"{len(train)} sequences, {trainer.batches} batches an epoch")
    held_out = holdfast._core._read_clips(options.held_out, options.wrist) if options.held_out else None
    if held_out == []:
        raise holdfast.Error(f"{options.held_out}: contains no clip for validation. Leave out --held-out, or hold "
                             "people out with 'make-reach-data --held-out'")
    recipe = run.recipe(Options(), None, options, RECIPE)
    recipe.wrist = options.wrist
    recipe.ankle_m, recipe.ball_m = (float(rest_joints[joint, 1] - sole_y) for joint in (7, 10))
    start, statistics = None, data["statistics"]
    if options.start:
        texts, start = networks.read_safetensors(options.start)
        warning = holdfast._core._old_pelvis_warning(options.start, texts)
        if warning:
            run.note(options, f"warning: {warning}")
        if not networks.under(start, "encoder") and (recipe.free_from > 0.0 or recipe.free_share < 1.0):
            raise holdfast.Error(f"{options.start}: has no encoder. Give weights written by 'holdfast.train wandr'")
        statistics = {name: x for name, x in start.items() if name.startswith("statistics.")}
        decoder = networks.network_of(networks.under(start, "decoder"), options.start)
        recipe.layout = texts.get("intention", "paper")
        recipe.residual = isinstance(decoder, networks.Residual)
        recipe.latent = next(decoder.parameters()).shape[-1] - POSE - STATE - INTENTION[recipe.layout]
    norms = Norms(statistics, device)
    corpus = Corpus(data["clips"], bones, norms, recipe, device)
    held_out = held_out and Corpus(held_out, bones, norms, recipe, device)
    trainer = Trainer(corpus, held_out, norms, bones, recipe, device, start, body)
    return go_on(trainer, recipe, f"{len(data['clips'])} clips with mirror images")
