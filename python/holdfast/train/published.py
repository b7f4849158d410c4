# SPDX-License-Identifier: MIT
"""WANDR's published recipe: hindsight goals, losses and schedule of the paper (Diomataris et al. 2024,
section 3), with the settings of its released code where the paper states none.

Every sequence is used once an epoch, its first 8 s only. All frames are predicted from the ground
truth before them (teacher-forced); from epoch 10 on, windows of 2 to 10 frames are also rolled out
with latents from N(0, I)."""

import dataclasses

import numpy as np
import torch

import holdfast
from holdfast.train import motion, networks, run, wandr

FRAMES = 240  # of a sequence: 8 s
FARTHEST_FOOT = 0.20  # meters between the highest and the lowest place of a foot
CUTOFF = 1.5  # meters that the pelvis moves to a hindsight goal
FREE_BITS = 0.05  # least divergence of a latent
LONGEST_WINDOW, EPOCHS_A_FRAME = 10, 5  # rollouts in training get a frame longer every 5 epochs
FEET = (10, 11)
INTENTIONS = {"full": (1, 1, 1), "no-heading": (1, 1, 0), "no-pelvis": (1, 0, 1), "wrist": (1, 0, 0)}


@dataclasses.dataclass
class Options:
    intention: str = "full"  # parts that the network sees: of wrist, pelvis, heading
    motion: str = "both"  # sequences to train on: locomotion, reaching, both
    epochs: int = 801
    batch: int = 128  # sequences
    kl: float = 0.01
    learning_rate: float = 1e-4  # of Adam, constant
    dropout: float = 0.03
    latent: int = 64
    wrist: str = "right"
    layout: str = "paper"
    seed: int = 1


class Sequences:
    """Sequences on one device: poses (S, 240, 135), padded with the last frame; `length` (S,) is the
    number of valid frames. `label` (S, 240): the frame of the next labeled goal, the frame itself
    after the last goal, -1 in sequences without labels."""

    def __init__(self, clips, bones, norms, options, device):
        self.norms, self.bones, self.device, self.options = norms, bones, device, options
        self.wrist = motion.RIGHT_WRIST if options.wrist == "right" else motion.LEFT_WRIST
        count = len(clips)
        states = np.empty((count, FRAMES, wandr.STATE), np.float32)
        self.length = np.array([min(len(states), FRAMES) for states, *_ in clips])
        self.label = np.full((count, FRAMES), -1)
        for s, (own, _, due, made) in enumerate(clips):
            length = self.length[s]
            states[s, :length], states[s, length:] = own[:length], own[length - 1]
            if made:
                frame = np.arange(FRAMES)
                ahead = np.searchsorted(due, frame, side="right")
                labels = np.concatenate((due, [FRAMES]))[ahead]
                self.label[s] = np.where(labels < length, labels, frame)
        pose = wandr.Pose.of_states(torch.from_numpy(states))
        cpu = bones.cpu()
        flat = pose.rotations.flatten(0, 1), pose.transl.flatten(0, 1), cpu
        wrist = motion.wrist_position(*flat, self.wrist).view(count, FRAMES, 3)
        self.wrists = wrist.numpy()
        self.pelvis = (pose.transl + cpu[:, 0]).numpy()
        c, s = motion.heading_of(flat[0][:, 0])
        self.facing = torch.cat((s, -c), 1).view(count, FRAMES, 2).numpy()
        self.states = torch.from_numpy(states).to(device)

    def __len__(self):
        return len(self.length)

    def goals(self, sequences, draws):
        """Hindsight goals of every frame: place of the wrist (N, 240, 3), frames until then (N, 240),
        0 where there is none, and the heading (N, 240, 2) of the body there."""
        frame = np.arange(FRAMES)
        way = self.pelvis[sequences, :, None, :2] - self.pelvis[sequences, None, :, :2]
        far = (np.square(way).sum(-1) >= CUTOFF**2) & (frame[None] >= frame[:, None])
        far &= frame < self.length[sequences, None, None]
        chance = np.where(far, draws.random(far.shape, dtype=np.float32), 0.0)
        drawn = np.where(far.any(2), chance.argmax(2), frame)
        label = self.label[sequences]
        at = np.where(label >= 0, label, drawn)
        row = sequences[:, None]
        return self.wrists[row, at], at - frame, self.facing[row, at]

    def batch(self, sequences, draws):
        """(pose of all frames, normalized deltas to them (N, 240, 135), goals, frames left, headings,
        which frames 0 to 238 have a next one (N, 239)), flat over N times frames except the last."""
        states = self.states[torch.from_numpy(sequences).to(self.device)]
        pose = wandr.Pose.of_states(states)
        before = wandr.Pose(pose.transl[:, :-1].flatten(0, 1), pose.rotations[:, :-1].flatten(0, 1))
        after = wandr.Pose(pose.transl[:, 1:].flatten(0, 1), pose.rotations[:, 1:].flatten(0, 1))
        rest = torch.tensor([0.0] * 3 + [1.0, 0.0, 0.0, 0.0, 1.0, 0.0] * 22, device=self.device)
        deltas = torch.cat((rest.expand(len(states), 1, wandr.STATE),
                            before.delta_to(after).unflatten(0, (len(states), FRAMES - 1))), 1)
        deltas = self.norms.normalized(deltas)
        goal, eta, facing = (torch.from_numpy(x.astype(np.float32)).to(self.device)
                             for x in self.goals(sequences, draws))
        valid = np.arange(FRAMES - 1)[None] < self.length[sequences, None] - 1
        return pose, deltas, goal, eta, facing, torch.from_numpy(valid).to(self.device)


class Trainer:
    """As run.train expects; weights, evaluation and checkpoints as wandr.Trainer's."""

    FORMAT, EVALUATION = "wandr-published-1", "reach"

    def __init__(self, sequences, held_out, norms, bones, options, device, body=None):
        o = self.options = options
        self.sequences, self.held_out, self.norms, self.device, self.body = sequences, held_out, norms, device, body
        self.loop = wandr.Loop(norms, bones, wandr.Options(layout=o.layout, wrist=o.wrist))
        condition = wandr.POSE + wandr.STATE + wandr.INTENTION[o.layout]
        self.decoder, self.encoder = (
            networks.network_of(holdfast._core._random_chain(size, output, seed)).to(device)
            for size, output, seed in ((condition + o.latent, wandr.STATE, 2 * o.seed),
                                       (condition + wandr.STATE, 2 * o.latent, 2 * o.seed + 1)))
        for network in (self.decoder, self.encoder):
            for part in network.modules():
                if isinstance(part, torch.nn.Dropout):
                    part.p = o.dropout
        self.parameters = [*self.decoder.parameters(), *self.encoder.parameters()]
        self.optimizer = torch.optim.Adam(self.parameters, lr=o.learning_rate)
        self.batches = max(1, -(-len(sequences) // o.batch))
        self.iteration, self.iterations = 0, o.epochs * self.batches
        self.parts = torch.tensor(INTENTIONS[o.intention], device=device).repeat_interleave(3)

    @property
    def epoch(self):
        return self.iteration // self.batches

    def condition(self, pose, delta, goal, eta, facing):
        condition = self.loop.condition(pose, delta, goal, eta.clamp_min(0.0), (eta > 0.0).float(), facing)
        # With multiplied parts a network trained without them never sees them.
        return torch.cat((condition[:, :-9], condition[:, -9:] * self.parts), 1)

    def joint_error(self, pose, truth):
        """Mean squared error of the joints, cm^2, (N,)."""
        joints, _ = motion.forward_joints(pose.rotations, pose.transl, self.loop.bones)
        true, _ = motion.forward_joints(truth.rotations, truth.transl, self.loop.bones)
        return (100.0 * (joints - true)).square().mean((1, 2))

    def step(self):
        o, epoch = self.options, self.epoch
        order = run.random_of(o.seed, epoch)[0].permutation(len(self.sequences))
        at = (self.iteration % self.batches) * o.batch
        draws, noise = run.random_of(o.seed + 1, self.iteration)
        torch.manual_seed(int(draws.integers(2**63)))  # of dropout
        self.optimizer.zero_grad()
        losses = self.losses(self.sequences.batch(order[at : at + o.batch], draws), draws, noise, epoch)
        losses["total"].backward()
        losses = {name: float(loss) for name, loss in losses.items()}
        squares = [parameter.grad.square().sum() for parameter in self.parameters if parameter.grad is not None]
        losses["gradient"] = float(torch.stack(squares).sum().sqrt())  # not clipped
        if np.isfinite(losses["total"]):
            self.optimizer.step()
        return "train", losses, {}

    def losses(self, batch, draws, noise, epoch):
        o = self.options
        pose, deltas, goal, eta, facing, valid = batch
        frames = valid.flatten().nonzero()[:, 0]

        def here(x):  # of all frames with a next one
            return x[:, :-1].flatten(0, 1)[frames]

        now = wandr.Pose(here(pose.transl), here(pose.rotations))
        next_one = wandr.Pose(pose.transl[:, 1:].flatten(0, 1)[frames], pose.rotations[:, 1:].flatten(0, 1)[frames])
        condition = self.condition(now, here(deltas), here(goal), here(eta)[:, None], here(facing))
        target = deltas[:, 1:].flatten(0, 1)[frames]
        code = self.encoder(torch.cat((target, condition), 1))
        mean, spread = code[:, : o.latent], code[:, o.latent :].clamp(-10.0, 4.0)
        z = mean + torch.randn(mean.shape, generator=noise).to(self.device) * torch.exp(spread)
        output = self.decoder(torch.cat((z, condition), 1))
        parts = wandr.block_means((output - target).square()).mean(1)
        divergence = 0.5 * (mean.square() + spread.exp() - 1.0 - spread)
        joints = self.joint_error(self.loop.step(now, output), next_one).mean()
        total = parts.sum() + o.kl * divergence.clamp_min(FREE_BITS).mean() + joints
        losses = dict(zip(("translation", "orientation", "pose"), parts))
        losses.update(kl=divergence.mean(), joints=joints)
        length = int(draws.integers(min(epoch // EPOCHS_A_FRAME, LONGEST_WINDOW) + 1))
        if length >= 2:
            losses["rollout"] = self.rollout(pose, deltas, goal, eta, facing, valid, length, draws, noise)
            total = total + losses["rollout"]
        return {**losses, "total": total}

    def rollout(self, pose, deltas, goal, eta, facing, valid, length, draws, noise):
        """Windows of `length` frames, one after another, rolled out by latents from N(0, I)."""
        windows, spare = divmod(FRAMES, length)
        first = spare if draws.random() < 0.5 else 0

        def cut(x):  # (count, 240, ...) -> (count * windows, length, ...)
            return x[:, first : first + windows * length].unflatten(1, (windows, length)).flatten(0, 1)

        transl, rotations, deltas, goal, eta, facing = map(cut, (pose.transl, pose.rotations, deltas, goal, eta, facing))
        # Of windows that reach into the padding nothing is learned.
        known = torch.cat((torch.ones_like(valid[:, :1]), valid), 1)
        known = cut(known).all(1)
        body, delta, loss = wandr.Pose(transl[:, 0][known], rotations[:, 0][known]), deltas[:, 0][known], 0.0
        for a in range(length - 1):
            truth = wandr.Pose(transl[:, a + 1][known], rotations[:, a + 1][known])
            condition = self.condition(body, delta, goal[:, a][known], eta[:, a][known][:, None], facing[:, a][known])
            z = torch.randn(len(delta), self.options.latent, generator=noise).to(self.device)
            delta = self.decoder(torch.cat((z, condition), 1))
            corrective = self.norms.normalized(body.delta_to(truth))
            body = self.loop.step(body, delta)
            loss = loss + wandr.block_means((delta - corrective).square()).sum(0).mean() + self.joint_error(body, truth).mean()
        return loss / (length - 1)

    def validate(self):
        """Losses of held-out sequences, teacher-forced."""
        draws, noise = run.random_of(0, 0)
        some = np.arange(min(self.options.batch, len(self.held_out)))
        for network in (self.decoder, self.encoder):
            network.eval()
        with torch.no_grad():
            losses = self.losses(self.held_out.batch(some, draws), draws, noise, 0)
        for network in (self.decoder, self.encoder):
            network.train()
        return {name: float(loss) for name, loss in losses.items()}

    def weights(self, encoder=True):
        tensors = {**self.norms.tensors, **networks.prefixed(self.decoder.state_dict(), "decoder")}
        return {**tensors, **(networks.prefixed(self.encoder.state_dict(), "encoder") if encoder else {})}

    def write(self, stem, notes):
        wandr.Trainer.write(self, stem, {**notes, "epoch": str(self.epoch), "intention_parts": self.options.intention})

    def evaluate(self, stem):
        return wandr.Trainer.evaluate(self, stem)

    is_better = staticmethod(wandr.Trainer.is_better)

    def state(self):
        tensors = {f"{part}.{name}": values for part in ("decoder", "encoder")
                   for name, values in getattr(self, part).state_dict().items()}
        return {**tensors, **run.optimizer_tensors("adam", self.optimizer)}, {}

    def load_state(self, tensors, texts):
        for part in ("decoder", "encoder"):
            getattr(self, part).load_state_dict(networks.under(tensors, part))
        run.load_optimizer("adam", tensors, self.optimizer)


def select(clips, bones, options):
    """(training, validation, test) sequences: those whose feet rise by more than 20 cm are dropped,
    the rest is shuffled and split 80/10/10. A generated clip is cut behind each goal, so that every
    sequence has one goal, as in CIRCLE."""
    kept = []
    for states, goals, due, made in clips:
        if options.motion != "both" and made != (options.motion == "reaching"):
            continue
        pose = wandr.Pose.of_states(torch.from_numpy(states))
        joints, _ = motion.forward_joints(pose.rotations, pose.transl, bones.cpu())
        feet = joints[:, FEET, 2]
        if float(feet.max() - feet.min()) > FARTHEST_FOOT:
            continue
        if not made:
            kept.append((states, goals, due, made))
            continue
        begins = 0
        for goal, frame in zip(goals, due):
            ends = min(frame + 15, len(states))
            if frame - begins > 15:
                kept.append((states[begins:ends], goal[None], np.array([frame - begins]), True))
            begins = frame
    if len(kept) < 10:
        raise holdfast.Error(f"corpus: {len(kept)} sequences of '{options.motion}' remain, 10 are needed. "
                             "Give more motion")
    order = np.random.default_rng(0).permutation(len(kept))
    ends = [int(0.8 * len(kept)), int(0.9 * len(kept))]
    return tuple([kept[k] for k in part] for part in np.split(order, ends))
