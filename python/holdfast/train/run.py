# SPDX-License-Identifier: MIT
"""Common parts of all trainings: command line, device, checkpoints, log, curves, and the loop."""

import argparse
import csv
import io
import json
import math
import pathlib
import signal
import sys
import time

import numpy as np
import torch

import holdfast
from holdfast.train import networks


def number(kind, least, most):
    """A type for argparse: a finite number from `least` to `most`."""
    def parse(text):
        value = kind(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"expected {least} to {most}, got {text}")
        return value
    parse.__name__ = kind.__name__
    return parse


def names(text):
    return [name for name in text.split(",") if name]


def parser(name, description, examples, output):
    """An argument parser with the options that every training has."""
    made = argparse.ArgumentParser(
        prog=f"python3 -m holdfast.train {name}", description=description,
        epilog="Examples:\n" + "".join(f"  python3 -m holdfast.train {line}\n" for line in examples),
        formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("-o", "--output", type=pathlib.Path, required=True, help=output)
    made.add_argument("--body", type=pathlib.Path, help="SMPL-X .npz (default: the embedded body)")
    made.add_argument("--seed", type=number(int, 0, 2**63 - 1), default=1)
    made.add_argument("--threads", type=number(int, 1, 1024), default=1,
                      help="number of CPU threads of PyTorch; sums depend on it (default 1)")
    made.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu",
                      help="cpu, cuda, cuda:1, ... (default: a GPU if available)")
    made.add_argument("--force", action="store_true", help="start again and overwrite existing output")
    made.add_argument("-q", "--quiet", action="store_true", help="print no progress and no notes")
    return made


def add_long(made, every, unit):
    """Options of trainings that evaluate and can be interrupted and resumed."""
    made.add_argument("--evaluate-every", type=number(int, 1, 1_000_000), default=every,
                      help=f"{unit} between evaluations (default {every})")
    made.add_argument("--patience", type=number(int, 0, 100_000_000), default=0,
                      help=f"stop after this many {unit} without improvement (default 0: never)")


def prepare(options):
    """The device to train on; makes PyTorch deterministic on one machine."""
    torch.set_num_threads(options.threads)
    try:
        device = torch.device(options.device)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        text = str(error).splitlines()[0]
        raise holdfast.Error(f"--device {options.device}: {text}. Give another device") from None
    return device


def recipe(ours, published, options, fields):
    """The training's options: `published` with --paper, else `ours`, overridden by those of `fields`
    that are given on the command line (argparse sets the others to None)."""
    made = published if getattr(options, "paper", False) else ours
    for field in fields:
        value = getattr(options, field)
        if value is not None:
            setattr(made, field, value)
    made.seed = options.seed
    return made


def refuse_with_paper(made, options, fields):
    """Rejects options that --paper does not have."""
    for field in fields:
        if options.paper and getattr(options, field) is not None:
            made.error(f"--paper excludes --{field.replace('_', '-')}")


def reader(options):
    """Progress of reading data, for the module; None when quiet."""
    return None if options.quiet else lambda stage, done, total: progress(stage, done, total)


def progress(name, done, total):
    """A line that overwrites itself on a terminal, every tenth part elsewhere."""
    if sys.stderr.isatty():
        print(f"\r{name}: {done} of {total}", end="\n" if done == total else "", file=sys.stderr)
    elif done == total or done % max(1, total // 10) == 0:
        print(f"{name}: {done} of {total}", file=sys.stderr, flush=True)


def note(options, text):
    if not options.quiet:
        print(text, file=sys.stderr, flush=True)


def body_of(options):
    return None if options.body is None else holdfast.BodyModel.load(str(options.body))


def random_of(seed, iteration):
    """Random generators (numpy's, torch's of the CPU) of an iteration, which depend only on the seed
    and its number, so that resuming is exact."""
    draws = np.random.default_rng([seed, iteration])
    return draws, torch.Generator().manual_seed(int(draws.integers(2**63)))


def optimizer_tensors(name, optimizer):
    """State of an optimizer, for a checkpoint."""
    return {f"{name}.{index}.{key}": torch.as_tensor(value, dtype=torch.float32)
            for index, state in optimizer.state_dict()["state"].items() for key, value in state.items()}


def load_optimizer(name, tensors, optimizer):
    state = {}
    for key, values in networks.under(tensors, name).items():
        index, _, what = key.partition(".")
        state.setdefault(int(index), {})[what] = values
    optimizer.load_state_dict({"state": state, "param_groups": optimizer.state_dict()["param_groups"]})


def save_checkpoint(path, trainer, fingerprint):
    """Everything needed to resume exactly, as safetensors, which executes nothing on reading."""
    tensors, texts = trainer.state()
    networks.write_safetensors(path, tensors, {
        "format": trainer.FORMAT, "options": fingerprint, "iteration": str(trainer.iteration), **texts})


def load_checkpoint(path, trainer, fingerprint):
    texts, tensors = networks.read_safetensors(path)
    if texts.get("format") != trainer.FORMAT:
        raise holdfast.Error(f"{path}: is not a checkpoint of this training ({trainer.FORMAT}). Give "
                             "another --output, or --force")
    if texts.get("options") != fingerprint:
        raise holdfast.Error(
            f"{path}: was made with different options or data ({texts.get('options')}), not {fingerprint}. "
            "Give the same options, another --output, or --force to start again")
    try:
        trainer.load_state(tensors, texts)
        trainer.iteration = int(texts["iteration"])
    except (KeyError, ValueError, RuntimeError, IndexError) as error:
        raise holdfast.Error(f"{path}: {error}. The file is damaged: start again with --force") from None


def flat(line):
    """{"validation": {"mpjpe_m": 1}} -> {"validation.mpjpe_m": 1}"""
    out = {}
    for name, value in line.items():
        if isinstance(value, dict):
            out.update({f"{name}.{key}": number for key, number in value.items()})
        else:
            out[name] = value
    return out


FIRST = ["kind", "iteration", "seconds"]


def means(some):
    """Mean of each loss over the steps that have it."""
    values = {}
    for losses in some:
        for key, loss in losses.items():
            values.setdefault(key, []).append(loss)
    return {key: sum(v) / len(v) for key, v in values.items()}


def write_log(path, lines):
    """training_log.csv: one line each 50 iterations and kind of them, and for each evaluation."""
    columns = FIRST + sorted({name for line in lines for name in line} - set(FIRST))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    networks.write_atomically(path, text.getvalue().encode())


def read_log(path, iteration):
    """The lines up to an iteration; later iterations are trained again."""
    if not path.exists():
        return []
    lines = []
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            try:
                line = {name: value if name == "kind" else float(value) for name, value in row.items() if value}
                line["iteration"] = int(line["iteration"])
            except (KeyError, ValueError, TypeError):
                continue
            if line["iteration"] <= iteration:
                lines.append(line)
    return lines


def draw_curves(path, panels, lines):
    """A figure of curves: `panels` is [(title, logarithmic, [(kind, column, scale, name)])].
    Without matplotlib there is none."""
    try:
        import matplotlib
    except ModuleNotFoundError:
        return False
    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = math.ceil(len(panels) / 2)
    figure, axes = pyplot.subplots(rows, 2, figsize=(11, 2.6 * rows), squeeze=False)
    for place, (title, logarithmic, curves) in zip(axes.flat, panels):
        place.set_title(title, fontsize=9)
        for kind, column, scale, name in curves:
            points = [(line["iteration"], scale * line[column]) for line in lines
                      if line["kind"] == kind and isinstance(line.get(column), (int, float))]
            if points:
                place.plot(*zip(*points), label=f"{name} {points[-1][1]:.4g}", linewidth=1)
        if place.lines:
            place.legend(fontsize=7)
        if logarithmic and place.lines:
            place.set_yscale("log")
        elif place.lines:
            place.set_ylim(bottom=min(0.0, place.get_ylim()[0]))
        place.tick_params(labelsize=7)
    for place in axes.flat[len(panels) :]:
        place.axis("off")
    figure.tight_layout()
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=110)
    pyplot.close(figure)
    networks.write_atomically(path, image.getvalue())
    return True


class Interruption:
    """Ctrl-C ends a training after the iteration under way; a second one ends it at once."""

    def __enter__(self):
        self.asked = False
        self.before = signal.signal(signal.SIGINT, self.ask)
        return self

    def ask(self, *_):
        self.asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    def __exit__(self, *_):
        signal.signal(signal.SIGINT, self.before)


def train(trainer, options, name, fingerprint, notes, panels, text_of):
    """Resumes from a checkpoint if there is one, trains to the end, and writes to --output: best.safetensors and
    latest.safetensors (each as _half too), checkpoint.safetensors (every two minutes),
    training_log.csv and training_curves.png. Returns the exit code.

    A trainer has iteration and iterations; step() -> (kind, losses, further columns); EVALUATION,
    the kind of evaluations; write(stem, notes); evaluate(stem of what was just written) -> dict;
    is_better(now, best); state() -> (tensors, texts) and load_state of them. `text_of`
    describes an evaluation to the user."""
    folder = options.output
    checkpoint, log = folder / "checkpoint.safetensors", folder / "training_log.csv"
    lines = []
    if checkpoint.exists() and not options.force:
        load_checkpoint(checkpoint, trainer, fingerprint)
        lines = read_log(log, trainer.iteration)
        note(options, f"resuming after iteration {trainer.iteration}")
    folder.mkdir(parents=True, exist_ok=True)
    notes = {**notes, "made_by": f"holdfast train {name} {holdfast.__version__}",
             **holdfast._core._rest_pelvis_notes()}
    best = None
    for line in lines:
        if line["kind"] == trainer.EVALUATION and (best is None or trainer.is_better(line, best)):
            best = line

    def keep(line, stem):
        trainer.write(folder / stem, {**notes, "iteration": str(trainer.iteration),
                                      **({"validation": json.dumps(line)} if line else {})})

    def report():
        write_log(log, lines)
        draw_curves(folder / "training_curves.png", panels, lines)

    began = saved = time.monotonic()
    sums = {}
    with Interruption() as interruption:
        while trainer.iteration < trainer.iterations and not interruption.asked:
            kind, losses, further = trainer.step()
            sums.setdefault(kind, []).append(losses)
            if not all(math.isfinite(losses[key]) for key in ("total", "gradient")):
                raise holdfast.Error(f"training: the loss is not finite at iteration {trainer.iteration}. "
                                     "Lower --learning-rate, and check the clips with 'holdfast doctor'")
            trainer.iteration += 1
            last = trainer.iteration == trainer.iterations
            if trainer.iteration % 50 == 0 or last:
                for kind, some in sorted(sums.items(), reverse=True):
                    lines.append({"kind": kind, "iteration": trainer.iteration,
                                  "seconds": round(time.monotonic() - began, 3), **further, **means(some)})
                sums = {}
                if not options.quiet:
                    progress("iterations", trainer.iteration, trainer.iterations)
            if trainer.iteration % options.evaluate_every == 0 or last:
                keep(None, "latest")
                line = flat({"kind": trainer.EVALUATION, "iteration": trainer.iteration,
                             **trainer.evaluate(folder / "latest")})
                lines.append(line)
                note(options, f"iteration {trainer.iteration}: {text_of(line)}")
                keep(line, "latest")
                if best is None or trainer.is_better(line, best):
                    best = line
                    keep(line, "best")
                report()
                if 0 < options.patience <= trainer.iteration - best["iteration"]:
                    break
            if time.monotonic() - saved > 120.0 or last:
                save_checkpoint(checkpoint, trainer, fingerprint)
                write_log(log, lines)
                saved = time.monotonic()
    save_checkpoint(checkpoint, trainer, fingerprint)
    report()
    reached = "not evaluated yet" if best is None else f"{text_of(best)} (iteration {best['iteration']})"
    print(f"{folder / 'best.safetensors'}: {trainer.iteration} iterations\n  best    {reached}\n"
          f"  curves  {folder / 'training_curves.png'}")
    if interruption.asked:
        note(options, "interrupted: the same command resumes from here")
        return 130
    return 0
