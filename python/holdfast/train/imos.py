# SPDX-License-Identifier: MIT
"""Training of IMoS's networks (Ghosh et al. 2023): as published, or both modules jointly,
unrolled as at run time, with a critic of whole motions."""

import dataclasses
import json
import math
import types

import numpy as np
import torch

import holdfast
from holdfast.train import motion, networks, run
from holdfast.train.imos_networks import ACTIONS, ARMS, HISTORY, KEY_FRAMES, OBJECTS, POSE, TRUNK, Networks

STEPS = KEY_FRAMES - HISTORY
TENSORS = ("pose", "transl", "joints", "object_T", "object_R", "by_left", "by_right", "bones", "betas")
FRAME = 66 + 9  # numbers of a key frame as the critic sees it


@dataclasses.dataclass
class Options:
    """How the networks are trained. The defaults are this project's; published() the authors'."""

    published: bool = False  # one step of Adam per key frame and module, nothing learned through time
    true_history_epochs: int = 300  # published: histories are the truth so long

    divergence: float = 0.001  # weights: of latents from N(0, 1)
    pose: float = 1.0  # mean |6D error|
    velocity: float = 1.0  # of the 6D step
    joints: float = 2.0  # meters
    num_joints: int = 22
    wrists: float = 3.0  # once more: hands say what is done
    root: float = 1.0  # of the root's step, meters

    iterations: int = 4000  # batches
    batch: int = 64
    learning_rate: float = 5e-4  # of AdamW (0.9, 0.999); ours is warmed up, then falls as a cosine
    weight_decay: float = 1e-4
    largest_gradient: float = 1.0
    dropout: float = 0.0
    present_share: float = 0.5  # of rows (published: of calls) driven by the present encoder

    history_noise: float = 0.02  # N(0, s^2) in histories' 6D; a third of it in meters
    shape_noise: float = 1.0  # on betas: few subjects must not be known by their shape ...
    stance_noise: float = 0.08  # ... nor by how they stand, radians
    lengthen_until: float = 0.5  # share of the iterations in which windows grow from 1 to 11
    running_from: float = 0.15  # from here on batch norms use the statistics they are run with
    critic: float = 0.06  # weight of the adversarial loss on whole motions
    critic_from: float = 0.5
    critic_blur: float = 0.01  # noise in the motions it sees, meters
    seed: int = 1


PUBLISHED_EPOCHS = 1600


def published():
    return Options(published=True, critic=0.0, weight_decay=0.0, dropout=0.1, history_noise=0.0, joints=1.0,
                   num_joints=16, wrists=0.0)


class Draws:
    """Random numbers of a generator on the CPU, wherever they are used."""

    def __init__(self, generator, device="cpu"):
        self.generator, self.device = generator, device

    def normal(self, shape, deviation=1.0):
        return torch.empty(shape).normal_(0.0, deviation, generator=self.generator).to(self.device)

    def bernoulli(self, shape, share):
        return torch.empty(shape).bernoulli_(share, generator=self.generator).to(self.device)

    def uniform(self, shape):
        return torch.rand(shape, generator=self.generator).to(self.device)

    def integers(self, shape, count):
        return torch.empty(shape, dtype=torch.int64).random_(0, count, generator=self.generator).to(self.device)


class Sequences(types.SimpleNamespace):
    """B sequences of 15 key frames: pose (B, T, 132), transl (B, T, 3), joints (B, T, 22, 3), object_T
    (B, T, 3), object_R (B, T, 3, 3), by_left and by_right (B, T) 1 where that wrist carries the object
    here, bones (B, 22, 3), betas (B, 10), action (B,), object_id (B, 54) one-hot."""

    @staticmethod
    def of_arrays(arrays, device="cpu"):
        object_id = torch.zeros(len(arrays["object"]), OBJECTS)
        object_id[torch.arange(len(object_id)), torch.from_numpy(arrays["object"]).long()] = 1.0
        return Sequences(**{name: torch.from_numpy(arrays[name]).to(device) for name in TENSORS},
                         action=torch.from_numpy(arrays["action"]).long().to(device),
                         object_id=object_id.to(device))

    def __len__(self):
        return len(self.pose)

    def rows(self, rows):
        rows = torch.as_tensor(rows, device=self.pose.device)
        return Sequences(**{name: values[rows] for name, values in vars(self).items()})


def disturb_stances(batch, deviation, draws):
    """Rotates joints by N(0, deviation^2) axis-angles, radians: legs, trunk and head equally in all key
    frames (the pelvis by half), arms in the given key frames, with decreasing amount afterwards and
    not from key frame 10 on. A carried object follows its wrist."""
    if deviation <= 0.0:
        return
    rows = len(batch)
    shares = torch.ones(KEY_FRAMES, 22, 1)
    shares[:, 0] = 0.5
    for t in range(HISTORY, KEY_FRAMES):
        way = min((t - HISTORY + 1) / (10 - HISTORY + 1), 1.0)
        shares[t, 16:] = 1.0 - way**3 * (10.0 - 15.0 * way + 6.0 * way * way)  # minimum jerk
    turns = draws.normal((rows, 1, 22, 3), deviation) * shares.to(batch.pose)
    with torch.no_grad():
        before = motion.rotations_of(batch.pose.flatten(0, 1).unflatten(1, (22, 6)))
        after = before @ motion.exponential(turns.flatten(0, 1))
        transl = batch.transl.flatten(0, 1)
        bones = batch.bones.unsqueeze(1).expand(-1, KEY_FRAMES, -1, -1).flatten(0, 1)
        was, now = (motion.forward_joints(R, transl, bones) for R in (before, after))
        T, R = motion.carried(batch.object_T.flatten(0, 1), batch.object_R.flatten(0, 1), was, now,
                              batch.by_left.flatten(), batch.by_right.flatten())
        each = lambda x: x.unflatten(0, (rows, KEY_FRAMES))
        batch.pose, batch.joints = each(motion.six_of(after).flatten(1)), each(now[0])
        batch.object_T, batch.object_R = each(T), each(R)


class Frame(types.SimpleNamespace):
    """A key frame: pose (B, 132), transl (B, 3), object (T, R), body (forward_joints), and the pose
    attended to, once needed."""


class Unroller:
    """The networks unrolled over a batch from 4 ground-truth key frames: at each step the pose of key
    frame t, and the object as carried by the predicted wrist. Keeps gradients through time."""

    def __init__(self, nets, batch, first, noise, draws):
        self.nets, self.batch, self.draws, self.t, self.history = nets, batch, draws, first, []
        nets.draws = draws
        for t in range(first - HISTORY, first):
            frame = self.truth(t)
            if noise > 0.0:
                frame.pose = frame.pose + draws.normal(frame.pose.shape) * noise
                frame.object = (frame.object[0] + draws.normal(frame.object[0].shape) * (noise / 3.0), frame.object[1])
                frame.body = self.body_of(frame.pose, frame.transl)
            self.history.append(frame)
        self.refresh()

    def body_of(self, pose, transl):
        return motion.forward_joints(motion.rotations_of(pose.unflatten(1, (22, 6))), transl, self.batch.bones)

    def refresh(self):
        """Recomputes phi of both modules after a change of the weights."""
        for frame in self.history:
            frame.attended = None
        b, embedded = self.batch, self.nets.action_embedding  # looked up twice: the modules share no graph
        if self.nets.two:
            seen = (b.object_id,) if self.nets.c.arms_see_class else ()
            self.arms_phi = self.nets.arms.condition(torch.cat((b.betas, *seen, embedded(b.action)), 1))
        self.body_phi = self.nets.body.condition(torch.cat((b.betas, b.object_id, embedded(b.action)), 1))

    def truth(self, t):
        b = self.batch
        return Frame(pose=b.pose[:, t], transl=b.transl[:, t], object=(b.object_T[:, t], b.object_R[:, t]),
                     body=self.body_of(b.pose[:, t], b.transl[:, t]), attended=None)

    def forget_predictions(self):
        self.history = [self.truth(t) for t in range(self.t - HISTORY, self.t)]

    def object_numbers(self, object, rotation=True):
        if not rotation:
            return object[0]
        rows = self.nets.c.object_rotation == "rows"
        return torch.cat((object[0], motion.six_of(object[1].transpose(1, 2) if rows else object[1]).flatten(1)), 1)

    def noise(self, like, sample):
        return self.draws.normal(like.shape) if sample else torch.zeros_like(like)

    def told(self):
        """Progress of the motion."""
        if not self.nets.c.sees_progress:
            return []
        return [torch.full_like(self.batch.pose[:, 0, :1], min(self.t / (KEY_FRAMES - 1), 1.0))]

    def predict_arms(self, past, present_share, sample):
        nets = self.nets
        with_rotation = nets.c.arms_object == "pose"
        seen = torch.cat([past, *(self.object_numbers(f.object, with_rotation) for f in self.history), *self.told()], 1)
        from_past = nets.arms.encode(torch.cat((seen, self.arms_phi), 1), "past")
        self.arms_divergence = from_past.divergence()
        z = from_past.sample(self.noise(from_past.mu, sample))
        if present_share > 0.0:
            truth = self.truth(self.t)
            present = nets.arms.encode(torch.cat((
                truth.pose[:, TRUNK:], self.object_numbers(truth.object, with_rotation), self.arms_phi), 1), "present")
            self.arms_divergence = self.arms_divergence + present.divergence()
            chosen = self.draws.bernoulli((len(z), 1), present_share)
            z = chosen * present.sample(self.noise(present.mu, sample)) + (1.0 - chosen) * z
        self.arms = self.history[-1].pose[:, TRUNK:] + nets.arms.decode(torch.cat((self.arms_phi, z, seen), 1))

    def body_input(self, arms_past, arms_now, true_object):
        nets, c, size = self.nets, self.nets.c, self.nets.pose_size
        for frame in self.history:
            if frame.attended is None:
                frame.attended = nets.attend(frame.pose[:, :size])
        parts = [frame.attended for frame in self.history]
        if nets.beside:
            parts += [frame.pose[:, :size] for frame in self.history]
        if nets.two:
            parts += [arms_past] + ([arms_now] if c.body_sees_arms_now else [])
        if c.object_now != "absent":
            now = self.truth(self.t) if c.object_now == "true" and true_object else self.history[-1]
            parts.append(self.object_numbers(now.object))
        parts += [self.object_numbers(frame.object) for frame in self.history]
        if nets.rooted:
            parts += [frame.transl for frame in self.history]
        return torch.cat([*parts, *self.told(), self.body_phi], 1)

    def predict(self, present_share=0.0, sample=True, true_arms=False, true_object=False):
        """Predicts key frame t without advancing. present_share: fraction of rows whose arms are driven by
        the present encoder's latents. true_arms: the body sees the true arms of the past and the frame."""
        nets, b, last = self.nets, self.batch, self.history[-1]
        arms_past = torch.cat([frame.pose[:, TRUNK:] for frame in self.history], 1)
        if nets.two:
            self.predict_arms(arms_past, present_share, sample)
        arms_now = self.arms if nets.two else None
        if true_arms:
            arms_past = b.pose[:, self.t - HISTORY : self.t, TRUNK:].flatten(1)
            arms_now = b.pose[:, self.t, TRUNK:]
        seen = self.body_input(arms_past, arms_now, true_object)
        latents = nets.body.encode(seen, "past")
        self.body_divergence = latents.divergence()
        output = nets.body.decode(torch.cat((latents.sample(self.noise(latents.mu, sample)), seen), 1))
        self.trunk = output[:, : nets.pose_size]
        if nets.c.body_makes == "step":
            self.trunk = self.trunk + last.pose[:, : nets.pose_size]
        frame = Frame(attended=None)
        frame.pose = torch.cat((self.trunk, self.arms), 1) if nets.two else self.trunk
        self.root_step = output[:, nets.pose_size :] if nets.rooted else None
        frame.transl = last.transl + self.root_step if nets.rooted else b.transl[:, self.t]
        # Apart, the body is not judged by what the arms do.
        posed = torch.cat((self.trunk, arms_now), 1) if true_arms and nets.two else frame.pose
        frame.body = self.body_of(posed, frame.transl)
        frame.object = motion.carried(*last.object, last.body, frame.body, b.by_left[:, self.t], b.by_right[:, self.t])
        return frame

    def judge(self, frame, options):
        """(the arms' loss or None, the body's loss, their parts) of the last prediction."""
        o, b, t, last = options, self.batch, self.t, self.history[-1].pose
        truth, before = b.pose[:, t], b.pose[:, t - 1]
        parts = dict.fromkeys(LOSSES, 0.0)

        # Of the modules' own outputs: the two losses share no graph, and may be followed one by one.
        def pose_losses(made, begin, name):
            of = lambda x: x[:, begin : begin + made.shape[1]]
            pose = (made - of(truth)).abs().mean()
            velocity = (made - of(last) - (of(truth) - of(before))).abs().mean()
            parts[name] += pose.item()
            parts["velocity"] += velocity.item()
            return o.pose * pose + o.velocity * velocity

        arms = None
        if self.nets.two:
            arms = pose_losses(self.arms, TRUNK, "arms") + o.divergence * self.arms_divergence
            parts["divergence"] += self.arms_divergence.item()
        body = pose_losses(self.trunk, 0, "body") + o.divergence * self.body_divergence
        parts["divergence"] += self.body_divergence.item()
        off = (frame.body[0] - b.joints[:, t]).abs()
        joints, wrists = off[:, : o.num_joints].mean(), off[:, 20:22].mean()
        body = body + o.joints * joints + o.wrists * wrists
        parts["joints"], parts["wrists"] = joints.item(), wrists.item()
        if self.nets.rooted:
            root = (self.root_step - (b.transl[:, t] - b.transl[:, t - 1])).abs().mean()
            parts["root"] = root.item()
            body = body + o.root * root
        parts["total"] = body.item() + (arms.item() if arms is not None else 0.0)
        return arms, body, parts

    def advance(self, frame):
        self.history = [*self.history[1:], frame]
        self.t += 1


LOSSES = ("divergence", "arms", "body", "velocity", "joints", "wrists", "root", "doubt", "critic", "total", "gradient")


class ActionCritic(networks.Critic):
    """Discriminates motions of the data and generated motions, conditioned on the action; real motions
    with a wrong label also count as fake (Reed et al. 2016). With a distance to the one true motion,
    networks regress to the mean motion; the critic only requires a plausible motion of the action.

    A motion is, from key frame 3 on: joints, the object's translation and rotation (6D), and the
    differences of these between key frames; each number with mean 0 and deviation 1 over the data."""

    def __init__(self, data, seed, network=None):
        size = (2 * (STEPS + 1) - 1) * FRAME
        super().__init__(network or networks.network_of(holdfast._core._random_residual(
            size, 0, 192, 2, ACTIONS, seed)).to(data.pose.device), 4e-4)
        motions = self.unscaled(self.true_frames(data))
        self.mean, self.deviation = motions.mean(0), motions.std(0).clamp_min(0.01)
        self.known = torch.unique(data.action)

    @staticmethod
    def frame(joints, object):
        return torch.cat((joints.flatten(1), object[0], motion.six_of(object[1]).flatten(1)), 1)

    @classmethod
    def true_frames(cls, batch):
        return [cls.frame(batch.joints[:, t], (batch.object_T[:, t], batch.object_R[:, t]))
                for t in range(HISTORY - 1, KEY_FRAMES)]

    @staticmethod
    def unscaled(frames):
        return torch.cat([*frames, *(b - a for a, b in zip(frames, frames[1:]))], 1)

    def motions(self, frames, blur, draws):
        """(B, 1725), positions with noise N(0, blur^2), meters, and rotations with 0.1 radian of noise per
        centimeter, so that hand tremor does not separate real and generated motions."""
        if blur > 0.0:
            deviation = torch.full((FRAME,), blur)
            deviation[-6:] = blur / 0.1
            frames = [frame + deviation.to(frame) * draws.normal(frame.shape) for frame in frames]
        return (self.unscaled(frames) - self.mean) / self.deviation

    def scores(self, motions, actions):
        return self.network(motions).gather(1, actions.unsqueeze(1)).squeeze(1)

    def learn_from(self, true, own, actions, draws):
        real = true.detach().clone().requires_grad_()
        score_real, score_own = self.scores(real, actions), self.scores(own.detach(), actions)
        wrong_loss = 0.0
        if len(self.known) > 1:
            wrong = self.known[draws.integers(actions.shape, len(self.known))]
            wrong_loss = ((wrong != actions) * (self.scores(real, wrong) + 1.0).square()).mean()
        return self.learn(real, score_real, score_own, 0.5 * (networks.belief_of(score_own) + wrong_loss))


class Plateau:
    """Lowers a learning rate when a loss no longer falls (ReduceLROnPlateau, relative threshold)."""

    def __init__(self, rate):
        self.rate, self.best, self.bad_epochs, self.epoch_loss = rate, 1e300, 0, 0.0

    def observe(self, loss):
        if loss < self.best * 0.95:
            self.best, self.bad_epochs = loss, 0
        elif self.bad_epochs + 1 > 3:
            self.rate, self.bad_epochs = max(2e-7, self.rate * 0.999), 0
        else:
            self.bad_epochs += 1


def starting_tensors(config, options, data, embeddings):
    """Initial tensors. Ours initialize a network that stands still: steps are small; if poses are
    predicted directly, the last block of the body's decoder passes on the previous pose, which it gets
    after self-attention: (v - mean) / deviation over the pose's numbers. Its output passes two leaky
    ReLUs: an offset keeps the first positive, and numbers that are always negative are scaled by five
    before the second."""
    tensors = {name: torch.from_numpy(x) for name, x in holdfast._core._imos_start(config, options.seed).items()}
    if embeddings is not None:
        tensors["action_embedding.weight"] = torch.from_numpy(embeddings)
    if options.published:
        return tensors
    draws = np.random.default_rng([options.seed, 0x1305])
    for name, values in sorted(tensors.items()):
        module, _, what = name.rpartition(".")
        layer = module.rpartition(".")[2]
        last = ".dec_rb2." in name
        if what.startswith("running_") or name.startswith("action_embedding"):
            continue
        if "bn" in layer or layer == "layer_norm":
            values.fill_((0.1 if last and layer == "bn2" else 1.0) if what == "weight" else 0.0)
        elif what == "weight":
            bound = (0.1 if last and layer == "fc3" else 1.0) / math.sqrt(values.shape[-1])
            values.copy_(torch.from_numpy(draws.uniform(-bound, bound, values.shape)))
        else:
            values.fill_(0.0)
    for name, values in tensors.items():
        if name.endswith("attn.w_combine.weight"):
            values *= 0.05
    size = TRUNK if config["modules"] == "two" else POSE
    shift, scale, skip, skip_bias = (tensors[f"body.dec_rb2.{name}"] for name in (
        "bn2.bias", "bn2.weight", "fc3.weight", "fc3.bias"))
    skip *= 0.05
    scale[size:] = 0.005  # steps of millimeters
    if config["body_makes"] == "step":
        scale[:size] = 0.02
        return tensors
    poses = data.pose[:, :, :size].flatten(0, 1).cpu()
    mean, deviation = poses.mean(0), poses.std(0)
    pose_mean, pose_deviation = 0.0, 1.0
    if config["self_attention"] == "yes":
        pose_mean, pose_deviation = poses.mean().item(), poses.std(1, unbiased=False).mean().item()
    # Larger where it may be positive, they would grow from key frame to key frame.
    gain = torch.where(mean < -2.0 * deviation, torch.tensor(5.0), torch.tensor(1.0))
    scale[:size] = 0.1 * gain * deviation
    places = int(config["body_latent"]) + (HISTORY - 1) * size + torch.arange(size)
    skip[torch.arange(size), places] += gain * pose_deviation
    skip_bias[:size] = gain * (pose_mean + 2.0)
    shift[:size] = -2.0 * gain
    return tensors


def batches_of(epochs, sequences, batch):
    """Number of batches of so many epochs; sequences left over after whole batches are in other epochs."""
    return epochs * max(1, sequences // min(batch, sequences))


class Trainer:
    FORMAT, EVALUATION = "imos-training-3", "rollout"

    def __init__(self, sets, config, options, device, embeddings=None):
        """`sets`: arrays of training, validation and held-out sequences as _read_action_set has them;
        `config` texts of a weights file."""
        o, self.options, self.config, self.device, self.sets = options, options, config, device, sets
        self.data = Sequences.of_arrays(sets["train"], device)
        if len(self.data) < 2:
            raise holdfast.Error(f"training: {len(self.data)} sequence(s) to train on. Give two or more of subjects "
                                 "that are not held out")
        o.batch = min(o.batch, len(self.data))
        some = np.arange(0, len(self.data), max(1, len(self.data) // 100))
        self.some = self.data.rows(some)  # to compare with those that are not trained on
        self.validation = Sequences.of_arrays(sets["validation"], device)
        self.nets = Networks(config, present=True)
        with torch.no_grad():
            self.nets.load(starting_tensors(config, o, self.data, embeddings), "training")
        self.nets.to(device).dropout = o.dropout
        self.critic = ActionCritic(self.data, o.seed)
        groups = {"all": ("",)}
        if o.published and self.nets.two:
            groups = {name: (name + ".", "action_embedding") for name in ("arms", "body")}
        self.parameters = {name: [p for n, p in self.nets.named_parameters() if n.startswith(prefix) and p.requires_grad]
                           for name, prefix in groups.items()}
        self.optimizers = {name: torch.optim.AdamW(p, lr=o.learning_rate, weight_decay=o.weight_decay)
                           for name, p in self.parameters.items()}
        self.plateaus = {name: Plateau(o.learning_rate) for name in groups}
        self.iteration, self.iterations = 0, o.iterations

    @property
    def progress(self):
        return self.iteration / self.iterations

    @property
    def batches(self):
        """Number of batches of an epoch; sequences left over after whole batches are in other epochs."""
        return len(self.data) // self.options.batch

    def draw_rows(self):
        order = np.random.default_rng([self.options.seed, 0xBDE7, self.iteration // self.batches])
        begin = self.iteration % self.batches * self.options.batch
        return order.permutation(len(self.data))[begin : begin + self.options.batch]

    def rate(self):
        o = self.options
        if o.published:
            return list(self.plateaus.values())[-1].rate
        warm = min(1.0, (self.iteration + 1) / 50)
        return o.learning_rate * warm * (0.01 + 0.99 * 0.5 * (1.0 + math.cos(math.pi * self.progress)))

    def step(self):
        draws, generator = run.random_of(self.options.seed, self.iteration)
        batch, draw = self.data.rows(self.draw_rows()), Draws(generator, self.device)
        rate = self.rate()
        step = self.step_published if self.options.published else self.step_together
        losses = step(batch, draws, draw)
        return "train", losses, {"learning_rate": rate}

    def step_together(self, batch, draws, draw):
        """Trains both modules, unrolled as at run time with gradients through all steps, with the object
        as carried by the predicted wrist."""
        o = self.options
        lengthening = min(1.0, self.progress / o.lengthen_until) if o.lengthen_until > 0.0 else 1.0
        steps = min(STEPS, 1 + int(lengthening * STEPS))
        first = HISTORY + int(draws.random() * (STEPS - steps + 1))
        loss, losses, shown = self.unroll(batch, first, steps, draw)
        optimizer, parameters = self.optimizers["all"], self.parameters["all"]
        optimizer.zero_grad(set_to_none=True)
        loss.backward(inputs=parameters)
        losses["gradient"] = torch.nn.utils.clip_grad_norm_(parameters, o.largest_gradient).item()
        if shown:
            losses["critic"] = self.critic.learn_from(*shown, batch.action, draw)
        for group in optimizer.param_groups:
            group["lr"] = self.rate()
        if math.isfinite(losses["gradient"]):
            optimizer.step()
        return losses

    def unroll(self, batch, first, steps, draw):
        """(loss, its parts, (true, own motions) for the critic, or nothing)."""
        o = self.options
        batch = Sequences(**vars(batch))
        batch.betas = batch.betas + draw.normal(batch.betas.shape, o.shape_noise)
        disturb_stances(batch, o.stance_noise, draw)
        criticized = o.critic > 0.0 and steps == STEPS and self.progress >= o.critic_from
        self.nets.train(self.progress < o.running_from)
        unroller = Unroller(self.nets, batch, first, o.history_noise, draw)
        # The critic sees motions as they are made at run time, where nobody knows the answer.
        present = o.present_share if self.nets.two and not criticized else 0.0
        loss, losses, seen = 0.0, dict.fromkeys(LOSSES, 0.0), []
        if criticized:
            truth = self.critic.true_frames(batch)
            true_motions = self.critic.motions(truth, o.critic_blur, draw)
            seen.append(truth[0])
        for _ in range(steps):
            frame = unroller.predict(present, true_object=True)
            arms, body, parts = unroller.judge(frame, o)
            loss = loss + body + (arms if arms is not None else 0.0)
            losses = {name: losses[name] + parts[name] / steps for name in LOSSES}
            if criticized:
                seen.append(self.critic.frame(frame.body[0], frame.object))
            unroller.advance(frame)
        loss = loss / steps
        self.nets.eval()
        if not criticized:
            return loss, losses, ()
        own = self.critic.motions(seen, o.critic_blur, draw)
        doubt = networks.doubt_of(self.critic.scores(own, batch.action))
        # It knows nothing at first: its weight grows over a tenth of the iterations.
        weighed = min(1.0, (self.progress - o.critic_from) / 0.1) * o.critic * doubt
        losses["doubt"] = doubt.item()
        losses["total"] += weighed.item()
        return loss + weighed, losses, (true_motions, own.detach())

    def step_published(self, batch, draws, draw):
        """One Adam step per key frame and module, with a fixed history: the ground truth for
        `true_history_epochs`, then predictions, but the ground truth again at key frame 9."""
        o = self.options
        self.nets.train()
        true_history = self.iteration // self.batches < o.true_history_epochs
        unroller = Unroller(self.nets, batch, HISTORY, o.history_noise, draw)
        losses = dict.fromkeys(LOSSES, 0.0)
        for t in range(HISTORY, KEY_FRAMES):
            if t > HISTORY and (true_history or t == 9):
                unroller.forget_predictions()
            # A fair coin per call, not per row.
            present = 1.0 if self.nets.two and draws.random() < o.present_share else 0.0
            unroller.refresh()
            frame = unroller.predict(present, true_arms=True, true_object=True)
            arms, body, parts = unroller.judge(frame, o)
            module_losses = dict(zip(self.optimizers, (arms, body) if self.nets.two else (body,)))
            # All gradients first: both modules train the action vectors.
            gradients = {name: torch.autograd.grad(loss, self.parameters[name], allow_unused=True)
                         for name, loss in module_losses.items()}
            norms = [self.step_by(name, loss, gradients[name]) for name, loss in module_losses.items()]
            losses = {name: losses[name] + parts[name] / STEPS for name in LOSSES}
            losses["gradient"] += max(norms) / STEPS
            truth = unroller.truth(t)
            unroller.advance(Frame(pose=frame.pose.detach(), transl=frame.transl.detach(), object=truth.object,
                                   body=truth.body, attended=None))
        self.nets.eval()
        if (self.iteration + 1) % self.batches == 0:
            for plateau in self.plateaus.values():
                plateau.observe(plateau.epoch_loss / self.batches)
                plateau.epoch_loss = 0.0
        return losses

    def step_by(self, name, loss, gradients):
        """One step of an optimizer; returns the norm of the gradients before clipping."""
        parameters, plateau = self.parameters[name], self.plateaus[name]
        for parameter, gradient in zip(parameters, gradients):
            parameter.grad = gradient
        norm = torch.nn.utils.clip_grad_norm_(parameters, self.options.largest_gradient).item()
        for group in self.optimizers[name].param_groups:
            group["lr"] = plateau.rate
        self.optimizers[name].step()
        plateau.epoch_loss += loss.item() / STEPS
        return norm

    @torch.no_grad()
    def errors(self, batch):
        """Errors of free rollouts against the ground truth, one sample of latents each: means over
        sequences and the 11 predicted key frames, meters. still_m: of standing still."""
        distance = lambda a, b: torch.sqrt(((a - b) ** 2).sum(-1))
        unroller = Unroller(self.nets, batch, HISTORY, 0.0, Draws(run.random_of(0, 0)[1], self.device))
        still, sums = batch.joints[:, HISTORY - 1], {}
        for t in range(HISTORY, KEY_FRAMES):
            frame = unroller.predict()
            unroller.advance(frame)
            joints = distance(frame.body[0], batch.joints[:, t])
            left, right = batch.by_left[:, t], batch.by_right[:, t]
            none = 0.5 * (1.0 - left - right)
            wrist = joints[:, motion.LEFT_WRIST] * (left + none) + joints[:, motion.RIGHT_WRIST] * (right + none)
            now = {"mpjpe_m": joints, "wrists_m": wrist, "object_m": distance(frame.object[0], batch.object_T[:, t]),
                   "root_m": distance(frame.transl, batch.transl[:, t]), "still_m": distance(still, batch.joints[:, t])}
            for name, values in now.items():
                sums[name] = sums.get(name, 0.0) + values.mean().item() / STEPS
        return {**sums, "last_wrist_m": wrist.mean().item()}

    def evaluate(self, stem):
        line = {"train": self.errors(self.some)}
        return {**line, **({"validation": self.errors(self.validation)} if len(self.validation) else {})}

    def is_better(self, now, best):
        """Without a critic: the lower MPJPE. With a critic: the later one, because the mean motion
        minimizes a distance to the ground truth."""
        return self.options.critic > 0.0 or judged(now)["mpjpe_m"] <= judged(best)["mpjpe_m"]

    def data_notes(self):
        """Notes on the training data that are needed to run the network."""
        actions, objects = holdfast._core._vocabulary()
        train, seconds, seen = self.sets["train"], {}, {}
        for action, object, time, mirrored in zip(*(train[k] for k in (
                "action", "object", "seconds_per_key_frame", "mirrored"))):
            if not mirrored:
                seconds.setdefault(actions[action], []).append(time)
                of = seen.setdefault(actions[action], {})
                of[objects[object]] = of.get(objects[object], 0) + 1
        text = lambda value: json.dumps(value, separators=(",", ":"), sort_keys=True)
        return {"seconds_per_key_frame": text({k: float(sum(v) / len(v)) for k, v in seconds.items()}), "seen": text(seen),
                "data": f"{len(self.data)} sequences{' (mirror images counted)' if any(train['mirrored']) else ''}, "
                        f"{len(self.validation)} to validate, {len(self.sets['test']['action'])} held out"}

    def write(self, stem, notes):
        tensors = self.nets.tensors()
        texts = {**self.data_notes(), **notes, **self.config, "format": "imos-1"}
        networks.write_safetensors(f"{stem}.safetensors", tensors, texts)
        small = {name: x for name, x in tensors.items() if not is_present_encoder(name)}
        networks.write_safetensors(f"{stem}_half.safetensors", small, texts, lambda name, tensor: tensor.dim() > 1)

    def state(self):
        tensors = {**networks.prefixed(self.nets.tensors(), "network"),
                   **networks.prefixed(self.critic.network.state_dict(), "critic"),
                   **run.optimizer_tensors("critic_adam", self.critic.optimizer)}
        for name, optimizer in self.optimizers.items():
            tensors.update(run.optimizer_tensors(f"adam_{name}", optimizer))
        return tensors, {f"plateau_{name}": json.dumps(vars(plateau)) for name, plateau in self.plateaus.items()}

    def load_state(self, tensors, texts):
        with torch.no_grad():
            self.nets.load(networks.under(tensors, "network"), "checkpoint")
        self.critic.network.load_state_dict(networks.under(tensors, "critic"))
        run.load_optimizer("critic_adam", tensors, self.critic.optimizer)
        for name, optimizer in self.optimizers.items():
            run.load_optimizer(f"adam_{name}", tensors, optimizer)
            vars(self.plateaus[name]).update(json.loads(texts[f"plateau_{name}"]))


def is_present_encoder(name):
    return name.startswith(("arms.enc_bn1.", "arms.enc_rb1.", "arms.enc_rb2.", "arms.mu_present.", "arms.sigma_present."))


def judged(line):
    """The errors by which evaluations are compared."""
    kind = "validation" if "validation.mpjpe_m" in line else "train"
    return {name.partition(".")[2]: value for name, value in line.items() if name.startswith(kind + ".")}


PANELS = [
    ("Joint error of free rollouts, cm (validation subjects)", False,
     [("rollout", "validation.mpjpe_m", 100, "mean"), ("rollout", "train.mpjpe_m", 100, "training subjects"),
      ("rollout", "validation.still_m", 100, "standing still")]),
    ("Carrying wrist, error in cm", False,
     [("rollout", "validation.wrists_m", 100, "mean"), ("rollout", "validation.last_wrist_m", 100, "in the last key frame"),
      ("rollout", "train.wrists_m", 100, "training subjects")]),
    ("Errors of object and root, cm", False, [("rollout", "validation.object_m", 100, "object"), ("rollout", "validation.root_m", 100, "root")]),
    ("Losses of 6D poses in training", True, [("train", "arms", 1, "arms"), ("train", "body", 1, "body"), ("train", "velocity", 1, "steps")]),
    ("Losses of positions in training, meters", True,
     [("train", "joints", 1, "joints"), ("train", "wrists", 1, "wrists"), ("train", "root", 1, "root's steps")]),
    ("KL divergence per latent of all encoders, nats", True, [("train", "divergence", 1, "divergence")]),
    ("Critic: adversarial loss of whole motions, and its accuracy", False,
     [("train", "doubt", 1, "adversarial loss"), ("train", "critic", 1, "accuracy")]),
    ("Learning rate", True, [("train", "learning_rate", 1, "rate")]),
]

RECIPE = ("iterations", "batch", "learning_rate", "dropout", "present_share", "critic", "critic_blur", "stance_noise", "history_noise")


def add_clips(made, without):
    """Options of sequences of action clips."""
    made.add_argument("folders", nargs="+", help="folders of clips with objects, from 'holdfast make-actions' or imported")
    made.add_argument("--held-out", type=run.names, default=["s10"], help="test subjects, not used in training (default s10)")
    made.add_argument("--validation", type=run.names, default=["s1"], help="validation subjects, not used in training (default s1)")
    made.add_argument(without, dest="without", type=run.names, help="actions to leave out (--paper of imos: lift)")
    made.add_argument("--key-frames", choices=["whole", "paper"],
                      help="whole: 15 over the whole clip; paper: the first 15 of 20 spread over the contact with the object")


def read_sets(options, body, mirror):
    sets = holdfast._core._read_action_set(
        options.folders, body=body, key_frames=options.key_frames or "whole", validation=options.validation,
        held_out=options.held_out, without=options.without or [], mirror=mirror, threads=options.threads,
        progress=run.reader(options))
    for text in sets["notes"][:5]:
        run.note(options, f"left out: {text}")
    if len(sets["notes"]) > 5:
        run.note(options, f"left out: {len(sets['notes']) - 5} more")
    if not len(sets["train"]["action"]):
        raise holdfast.Error(f"{options.folders[0]}: all subjects are held out or for validation. Give fewer with "
                             "--held-out and --validation")
    return sets


def parse(arguments):
    made = run.parser("imos", "Trains IMoS's networks: actions with objects, from an intent.", [
        "imos actions -o out/imos --held-out s9,s10",
        "imos grab_clips -o out/paper --paper --action-vectors clip_embeddings.npz"],
        "folder for best.safetensors, checkpoint, log and curves; an interrupted training resumes there")
    number = run.number
    add_clips(made, "--drop")
    made.add_argument("--paper", action="store_true",
                      help="published networks, losses, schedule and key frames without 'lift', unless overridden by other options")
    made.add_argument("--mirror", action="store_true", help="add the mirror image of every sequence")
    made.add_argument("--no-attention", action="store_true", help="no self-attention over past poses (the paper's second ablation)")
    made.add_argument("--one-module", action="store_true", help="one network for arms and body (the third ablation)")
    table = made.add_mutually_exclusive_group()
    table.add_argument("--random-embeddings", action="store_true", help="fixed random vectors for actions (the first ablation)")
    table.add_argument("--action-vectors", help="512 numbers for each of the 29 labels (.npz, .safetensors) (default: learned)")
    made.add_argument("--from", dest="start", help="best.safetensors of an earlier training to start from")
    length = made.add_mutually_exclusive_group()
    length.add_argument("--iterations", type=number(int, 1, 100_000_000), help="number of batches (default 4000)")
    length.add_argument("--epochs", type=number(int, 1, 1_000_000),
                        help="number of passes over the sequences, in place of --iterations (--paper: default 1600)")
    made.add_argument("--batch", type=number(int, 2, 65536), help="batch size (default 64)")
    made.add_argument("--learning-rate", type=number(float, 1e-7, 1.0), help="Adam learning rate (default 5e-4)")
    made.add_argument("--dropout", type=number(float, 0.0, 0.9), help="dropout in blocks and attention (default 0; --paper: 0.1)")
    made.add_argument("--present-share", type=number(float, 0.0, 1.0),
                      help="fraction of sequences whose arms are driven by the encoder that sees the target (default 0.5)")
    made.add_argument("--critic", type=number(float, 0.0, 1000.0),
                      help="weight of the adversarial loss on whole motions, after half of the iterations (default 0.06)")
    made.add_argument("--critic-blur", type=number(float, 0.0, 0.2),
                      help="noise on the critic's input, meters, which hides tremor (default 0.01)")
    made.add_argument("--stance-noise", type=number(float, 0.0, 1.0),
                      help="noise on the stance, constant over a sequence, radians (default 0.08)")
    made.add_argument("--noise", dest="history_noise", type=number(float, 0.0, 1.0),
                      help="noise on the given past poses, in 6D (default 0.02; --paper: none)")
    run.add_long(made, 200, "batches")
    options = made.parse_args(arguments)
    run.refuse_with_paper(made, options, ("critic", "critic_blur", "stance_noise"))
    if options.paper:
        options.key_frames = options.key_frames or "paper"
        options.without = ["lift"] if options.without is None else options.without
    return options


def configuration(options):
    """Texts of a weights file, and the initial embeddings (or None)."""
    config = holdfast._core._imos_config(options.paper)
    embeddings = None
    if options.action_vectors:
        config.update(action_embedding="given", action_size="512")
        embeddings = holdfast._core._read_action_table(options.action_vectors, 512)
    elif options.paper:
        config["action_embedding"] = "learned"
    if options.random_embeddings:
        config["action_embedding"] = "random"
    if options.no_attention:
        config["self_attention"] = "no"
    if options.one_module:
        config["modules"] = "one"
    return config, embeddings


def main(arguments):
    options = parse(arguments)
    device = run.prepare(options)
    sets = read_sets(options, run.body_of(options), options.mirror)
    config, embeddings = configuration(options)
    if options.paper and options.iterations is None:
        options.epochs = options.epochs or PUBLISHED_EPOCHS
    if options.epochs:
        count = len(sets["train"]["action"])
        options.iterations = batches_of(options.epochs, count, options.batch or Options.batch)
    recipe = run.recipe(Options(), published(), options, RECIPE)
    if options.start and not options.paper:
        # Weights that can walk already need not learn it step by step.
        recipe.lengthen_until = recipe.running_from = recipe.critic_from = 0.0
    trainer = Trainer(sets, config, recipe, device, embeddings)
    if options.start:
        texts, tensors = networks.read_safetensors(options.start)
        warning = holdfast._core._old_pelvis_warning(options.start, texts)
        if warning:
            run.note(options, f"warning: {warning}")
        if any(texts.get(name) != text for name, text in config.items()):
            raise holdfast.Error(f"{options.start}: has a different configuration. Give the options of its "
                                 "training")
        with torch.no_grad():
            trainer.nets.load(tensors, options.start)
    count = sum(p.numel() for p in trainer.nets.parameters() if p.requires_grad)
    run.note(options, f"{len(trainer.data)} sequences to train on, {len(trainer.validation)} to validate, "
             f"{len(sets['test']['action'])} held out; {count / 1e6:.2f} M parameters; {trainer.batches} batches per epoch; "
             f"on {device}")
    data = trainer.data
    fingerprint = (f"{dataclasses.asdict(recipe)} {config} data {len(data)} sequences "
                   f"{data.pose.double().sum().item():.9g} {data.object_T.double().abs().sum().item():.9g}")

    def text_of(line):
        cm = {name: 100.0 * value for name, value in judged(line).items()}
        return (f"joints {cm['mpjpe_m']:.2f} cm (still: {cm['still_m']:.2f}), wrist {cm['wrists_m']:.2f} cm, "
                f"object {cm['object_m']:.2f} cm")

    return run.train(trainer, options, "imos", fingerprint, {"key_frames": options.key_frames or "whole"}, PANELS, text_of)
