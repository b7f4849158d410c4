# SPDX-License-Identifier: MIT
"""Training of the recognizer: the action classifier that evaluates syntheses (that of IMoS, Ghosh et
al. 2023)."""

import dataclasses
import math

import torch
from torch import nn
from torch.nn import functional

import holdfast
from holdfast.train import imos, networks, run
from holdfast.train.imos_networks import ACTIONS

PLANES = (("2_2", [0, 1]), ("2_3", [0, 2]))  # (x, y) and (x, z)


@dataclasses.dataclass
class Options:
    """How the recognizer is trained. The defaults are this project's; published() the authors'."""

    batch: int = 16
    epochs: int = 300
    learning_rate: float = 2e-3  # of Adam
    falling: bool = True  # to 0, as a cosine over the epochs
    largest_gradient: float = 1.0
    patience: int = 60  # epochs without a better validation; 0: never stops early
    # Before so many steps it never stops: for some hundred the network knows nothing but how often each
    # action is, and its loss does not fall.
    least_steps: int = 2000
    # Learns from coordinates of mean 0 and deviation 1; the weights that come out take them as they are.
    standardize: bool = True
    softmax: bool = True  # cross-entropy of the softmax; else binary cross-entropy of each action
    stance: float = 0.05  # meters: each coordinate shifted, the same in all key frames; the whole scaled by up to a tenth
    jitter: float = 0.01  # meters, on every coordinate of every key frame
    seed: int = 1


def published():
    return Options(batch=1, epochs=500, learning_rate=5e-4, patience=0, standardize=False, softmax=False,
                   falling=False, stance=0.0, jitter=0.0)


class Recognizer(nn.Module):
    """Two LSTMs of two layers of 128; a convolution along each one's last outputs; the sum y gives the
    scores W y + b of 29 actions. Motions are (N, T, 66) meters."""

    def __init__(self, tensors):
        super().__init__()
        for plane, _ in PLANES:
            setattr(self, f"lstm{plane}", nn.LSTM(44, 128, num_layers=2, batch_first=True))
            setattr(self, f"conv1_{plane}", nn.Conv1d(1, 1, 3, padding=1))
        self.hidden2label = nn.Linear(128, ACTIONS)
        self.load_state_dict({name: torch.as_tensor(values) for name, values in tensors.items()})

    def forward(self, motions):
        points, y = motions.unflatten(2, (22, 3)), 0.0
        for plane, axes in PLANES:
            outputs, _ = getattr(self, f"lstm{plane}")(points[..., axes].flatten(2))
            y = y + getattr(self, f"conv1_{plane}")(outputs[:, -1:])[:, 0]
        return self.hidden2label(y)


class Scale:
    """Mean and deviation of each coordinate over key frames and motions."""

    def __init__(self, motions=None):
        self.mean, self.deviation = torch.zeros(66), torch.ones(66)
        if motions is not None:
            rows = motions.flatten(0, 1)
            self.mean, self.deviation = rows.mean(0), rows.std(0).clamp_min(0.01)

    def standardized(self, motions):
        return (motions - self.mean.to(motions)) / self.deviation.to(motions)

    def folded(self, tensors):
        """Weights for raw coordinates, from those for standardized coordinates."""
        tensors = {name: values.detach().cpu().clone() for name, values in tensors.items()}
        for plane, axes in PLANES:
            mean, deviation = (x.cpu().view(22, 3)[:, axes].flatten() for x in (self.mean, self.deviation))
            weight = tensors[f"lstm{plane}.weight_ih_l0"]
            weight /= deviation
            bias = tensors[f"lstm{plane}.bias_ih_l0"]
            bias.copy_(bias.double() - weight.double() @ mean.double())
        return tensors


class Training:
    """The network with its optimizer and the motions in the form of its input."""

    def __init__(self, motions, labels, validation, options, device, start=None):
        """motions (N, T, 66) meters, labels (N,) actions; `validation` a pair of the same, may be empty."""
        self.options, self.device = options, device
        self.network = Recognizer(start or holdfast._core._recognizer_start(options.seed)).to(device)
        self.optimizer = torch.optim.Adam(self.network.parameters(), lr=options.learning_rate)
        self.motions, self.labels = motions.to(device), labels.to(device)
        self.scale = Scale(self.motions) if options.standardize else Scale()
        self.validation = tuple(x.to(device) for x in validation)

    def loss(self, logits, labels):
        if self.options.softmax:
            return functional.cross_entropy(logits, labels)
        return functional.binary_cross_entropy_with_logits(logits, functional.one_hot(labels, ACTIONS).float())

    def shown(self, some, draw):
        """Motions with random augmentation of stance and body size."""
        o, shown = self.options, self.motions[some]
        if o.stance > 0.0:
            shift = draw.normal((len(shown), 1, 66), o.stance)
            shown = shown * (1.0 + 0.1 * (2.0 * draw.uniform((len(shown), 1, 1)) - 1.0)) + shift
        if o.jitter > 0.0:
            shown = shown + draw.normal(shown.shape, o.jitter)
        return self.scale.standardized(shown)

    def step(self, shown, labels):
        self.optimizer.zero_grad()
        loss = self.loss(self.network(shown), labels)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), self.options.largest_gradient)
        self.optimizer.step()
        return loss.item()

    def epoch(self, number):
        """One epoch (they count from 1): {training_loss, validation_loss, validation_accuracy}."""
        o, count = self.options, len(self.motions)
        draws, generator = run.random_of(o.seed, number)
        draw, order = imos.Draws(generator, self.device), torch.from_numpy(draws.permutation(count)).to(self.device)
        if o.falling:
            for group in self.optimizer.param_groups:
                group["lr"] = 0.5 * o.learning_rate * (1.0 + math.cos(math.pi * (number - 1) / o.epochs))
        mean = 0.0
        for some in order.split(o.batch):
            mean += self.step(self.shown(some, draw), self.labels[some]) * len(some) / count
        if not math.isfinite(mean):
            raise holdfast.Error(f"recognizer: its loss is no longer finite in epoch {number}. Give a lower --learning-rate")
        line = {"kind": "epoch", "iteration": number, "training_loss": mean}
        if len(self.validation[0]):
            with torch.no_grad():
                logits = self.network(self.scale.standardized(self.validation[0]))
                line["validation_loss"] = self.loss(logits, self.validation[1]).item()
                line["validation_accuracy"] = (logits.argmax(1) == self.validation[1]).double().mean().item()
        return line

    def run(self, progress=lambda line: True):
        """Trains; `progress` sees each epoch and ends the training by returning False. Returns (weights,
        line of their epoch, all lines): of the epoch with the highest validation accuracy, of those with
        the lowest loss (which rises with confidence long before accuracy falls); without validation the
        last."""
        o, lines, best, weights = self.options, [], None, None
        steps = math.ceil(len(self.motions) / o.batch)
        rank = lambda line: (line["validation_accuracy"], -line["validation_loss"])
        for number in range(1, o.epochs + 1):
            line = self.epoch(number)
            lines.append(line)
            validates = "validation_loss" in line
            if best is None or not validates or rank(line) > rank(best):
                best, weights = line, self.scale.folded(self.network.state_dict())
            if not progress(line):
                break
            if (validates and 0 < o.patience <= number - best["iteration"] and number * steps >= o.least_steps):
                break
        return weights, best, lines


PANELS = [
    ("Cross-entropy", True, [("epoch", "training_loss", 1, "training"), ("epoch", "validation_loss", 1, "validation")]),
    ("Validation accuracy, %", False, [("epoch", "validation_accuracy", 100, "accuracy")]),
]


def motions_of(arrays):
    return torch.from_numpy(arrays["joints"]).flatten(2), torch.from_numpy(arrays["action"]).long()


@torch.no_grad()
def accuracy_of(network, arrays, actions):
    """(fraction of motions whose action is recognized, {"drink for eat": count})."""
    motions, labels = motions_of(arrays)
    mistaken, seen = {}, network(motions).argmax(1)
    for label, guess in zip(labels.tolist(), seen.tolist()):
        if label != guess:
            which = f"{actions[label]} for {actions[guess]}"
            mistaken[which] = mistaken.get(which, 0) + 1
    return (seen == labels).double().mean().item(), mistaken


def parse(arguments):
    made = run.parser("recognizer", "Trains the action classifier that evaluates syntheses.", [
        "recognizer actions -o recognizer.safetensors --held-out s9,s10",
        "recognizer grab_clips --without lift --key-frames paper --paper -o paper.safetensors"],
        "file to write (.safetensors); log and curves are written beside it")
    number = run.number
    imos.add_clips(made, "--without")
    made.add_argument("--paper", action="store_true",
                      help="published settings, unless overridden by other options: 500 epochs, batch size 1, rate 5e-4, no "
                      "noise, no early stopping")
    made.add_argument("--epochs", type=number(int, 1, 1_000_000), help="maximum number of epochs (default 300)")
    made.add_argument("--batch", type=number(int, 1, 100_000), help="batch size (default 16)")
    made.add_argument("--learning-rate", type=number(float, 1e-9, 1.0), help="Adam learning rate (default 2e-3)")
    made.add_argument("--jitter", type=number(float, 0.0, 1.0),
                      help="standard deviation of noise on every coordinate, meters (default 0.01)")
    made.add_argument("--patience", type=number(int, 0, 1_000_000),
                      help="stop after this many epochs without improvement on validation (default 60; 0: never)")
    return made.parse_args(arguments)


def main(arguments):
    options = parse(arguments)
    if options.output.exists() and not options.force:
        raise holdfast.Error(f"{options.output}: exists already. Choose another name, or give --force")
    device = run.prepare(options)
    sets = imos.read_sets(options, run.body_of(options), not options.paper)  # the other hand does the same
    recipe = run.recipe(Options(), published(), options, ("epochs", "batch", "learning_rate", "jitter", "patience"))
    training = Training(*motions_of(sets["train"]), motions_of(sets["validation"]), recipe, device)
    with run.Interruption() as interruption:
        def seen(line):
            if not options.quiet:
                run.progress("epochs", line["iteration"], recipe.epochs)
            return not interruption.asked

        weights, best, lines = training.run(seen)
    if interruption.asked:
        return 130  # a quarter-trained judge is worse than none
    network, (actions, _) = Recognizer(weights), holdfast._core._vocabulary()
    text = f"{options.output}: epoch {best['iteration']} of {len(lines)}\n"
    notes = {}
    for name, arrays in (("training", sets["train"]), ("validation", sets["validation"]), ("held out", sets["test"])):
        count = len(arrays["action"])
        if count:
            accuracy, mistaken = accuracy_of(network, arrays, actions)
            notes[f"accuracy, {name}"] = f"{accuracy:.4f} of {count}"
            text += f"  {name:<12}{100.0 * accuracy:5.1f} % of {count} sequences"
            text += "; errors: " * bool(mistaken) + ", ".join(f"{k} ({n})" for k, n in sorted(mistaken.items())) + "\n"
    options.output.parent.mkdir(parents=True, exist_ok=True)
    networks.write_safetensors(options.output, weights, {
        **notes, "format": "imos-recognizer-1", "made_by": f"holdfast train recognizer {holdfast.__version__}",
        **holdfast._core._rest_pelvis_notes(), "key_frames": options.key_frames or "whole", "seed": str(options.seed),
        "epochs": str(best["iteration"]), "held_out": ",".join(options.held_out)})
    run.write_log(options.output.with_name(options.output.stem + "_log.csv"), lines)
    run.draw_curves(options.output.with_name(options.output.stem + "_curves.png"), PANELS, lines)
    print(text, end="")
    return 0
