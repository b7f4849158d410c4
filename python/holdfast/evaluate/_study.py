# SPDX-License-Identifier: MIT
"""What all studies share: a resumable store, a pool of processes, tables and the command line."""

import argparse
import csv
import hashlib
import io
import json
import math
import multiprocessing
import os
import pathlib
import sys
import tempfile

import numpy as np

import holdfast


def parser(name, description, example):
    """An argument parser with the options that every study has."""
    made = argparse.ArgumentParser(
        prog=f"python3 -m holdfast.evaluate {name}", description=description,
        epilog=f"Example:\n  python3 -m holdfast.evaluate {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("-o", "--output", type=pathlib.Path, required=True,
                      help="output folder; an interrupted study resumes there")
    made.add_argument("--jobs", type=int, default=os.cpu_count(), help="number of processes")
    made.add_argument("--seed", type=int, default=1, help="random seed")
    made.add_argument("--force", action="store_true",
                      help="replace results of a different configuration")
    return made


def write_atomically(path, text):
    """Writes `text` to `path` atomically."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def write_json(path, value):
    write_atomically(path, json.dumps(value, indent=1, allow_nan=False) + "\n")


def finish(folder, value, text, times=None):
    """Writes the results into `folder`, prints the table, and returns nothing.

    evaluation.json is `value` with the version, evaluation.md is `text`; neither may have wall
    times. `times` ({name: number or text}) are printed and go to timing.json.
    """
    write_json(folder / "evaluation.json", finite({"version": holdfast.__version__, **value}))
    write_atomically(folder / "evaluation.md", text)
    print(text, end="")
    if times:
        write_json(folder / "timing.json", finite(times))
        print("\n" + "\n".join(f"{name}: {time}" for name, time in times.items()))


def write_csv(path, rows):
    """Writes dicts as rows of a CSV file: nested keys become OUTER_INNER, lists are left out."""
    def scalars(row, prefix=""):
        for key, value in row.items():
            if isinstance(value, dict):
                yield from scalars(value, f"{prefix}{key}_")
            elif not isinstance(value, list):
                yield prefix + key, value

    flat = [dict(scalars(row)) for row in rows]
    text = io.StringIO()
    table = csv.DictWriter(text, list(dict.fromkeys(key for row in flat for key in row)),
                           lineterminator="\n")
    table.writeheader()
    table.writerows(flat)
    write_atomically(path, text.getvalue())


def finite(value):
    """`value` of dicts, lists and numbers for JSON: None where a number is NaN or infinite."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def contents(path_or_name):
    """Identifies an input of a configuration: a checksum of the file or of a folder's clips and
    meshes, or the name of an embedded input."""
    path = pathlib.Path(path_or_name)
    if not path.exists():
        return str(path_or_name)
    files = [path] if path.is_file() else sorted(path.glob("*.npz")) + sorted(path.glob("*.ply"))
    return [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]


def body_of(path):
    """The body model of a path, None (the embedded one) for none."""
    return holdfast.BodyModel.load(path) if path else None


def data_folder(name):
    """Folder `name` of HOLDFAST_DATA (default: the shared data beside this clone)."""
    return pathlib.Path(os.environ.get("HOLDFAST_DATA", "../shared/data")) / name


class Store:
    """Results of the parts of a study, one JSON line each in `folder`/`name`.jsonl.

    The first line is a checksum of `question`: everything that the results depend on. A store of
    another question raises holdfast.Error unless `force` replaces it. A last line cut off by an
    interrupt is dropped.
    """

    def __init__(self, folder, name, question, force=False):
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / f"{name}.jsonl"
        text = json.dumps([holdfast.__version__, question], sort_keys=True, default=str)
        head = json.dumps({"question": hashlib.sha256(text.encode()).hexdigest()})
        self.results = {}
        lines = self.path.read_text(encoding="utf-8").split("\n") if self.path.exists() else []
        if lines and lines[0] != head:
            if not force:
                raise holdfast.Error(
                    f"{self.path}: holds results of a different configuration. Choose another "
                    "folder, or --force to replace them")
            lines = []
        complete = lines[1:-1]
        for number, line in enumerate(complete, 2):
            try:
                entry = json.loads(line)
                self.results[entry["part"]] = entry["result"]
            except (ValueError, KeyError, TypeError):
                raise holdfast.Error(f"{self.path}:{number}: is damaged. Delete the line to "
                                     "compute its part again") from None
        write_atomically(self.path, "\n".join([head, *complete, ""]))

    def run(self, work, parts, jobs=1):
        """{name: work(argument)} for the {name: argument} of `parts`, in their order.

        `work` is a module-level function of a JSON-like argument; it returns what JSON can hold
        (NaN excluded). Parts already stored are not computed again. Each runs in one of `jobs`
        processes, which start afresh: no result depends on their number.
        """
        missing = {name: argument for name, argument in parts.items() if name not in self.results}
        done = len(parts) - len(missing)
        with open(self.path, "a", encoding="utf-8") as file:
            for name, result in _outcomes(work, missing, jobs):
                file.write(json.dumps({"part": name, "result": result}, allow_nan=False) + "\n")
                file.flush()
                self.results[name] = result
                done += 1
                progress(self.path.stem, done, len(parts))
        return {name: self.results[name] for name in parts}


def _call(task):
    work, name, argument = task
    return name, work(argument)


def _outcomes(work, parts, jobs):
    tasks = [(work, name, argument) for name, argument in parts.items()]
    if jobs <= 1 or len(tasks) <= 1:
        yield from map(_call, tasks)
        return
    with multiprocessing.get_context("spawn").Pool(min(jobs, len(tasks))) as pool:
        yield from pool.imap_unordered(_call, tasks)


def progress(name, done, total):
    """A line that overwrites itself on a terminal, every tenth part elsewhere."""
    if sys.stderr.isatty():
        print(f"\r{name}: {done} of {total}", end="\n" if done == total else "", file=sys.stderr)
    elif done == total or done % max(1, total // 10) == 0:
        print(f"{name}: {done} of {total}", file=sys.stderr, flush=True)


def fixed(value, digits, unit="", missing="-"):
    """A number of a table; `missing` for None and NaN."""
    if value is None or not math.isfinite(value):
        return missing
    return f"{value:.{digits}f}{' ' + unit if unit else ''}"


def markdown(head, rows, numbers=False):
    """A Markdown table of rows of strings; `numbers` stand to the right but in the first column."""
    rule = "---:|" if numbers else "---|"
    lines = ["| " + " | ".join(head) + " |", "|---|" + rule * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def percent(share, digits=1):
    return f"{100 * share:.{digits}f} %"


def or_none(value):
    """What JSON can hold of a number: None for NaN."""
    return float(value) if np.isfinite(value) else None


def checksum(path):
    """SHA-256 of a file, for the configuration of a store."""
    try:
        return hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()
    except OSError as error:
        raise holdfast.Error(f"{path}: {error.strerror}") from None


def head(schema, seed):
    return {"schema": schema, "holdfast_version": holdfast.__version__, "seed": seed}


def _mix(z):
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def uniforms(count, seed, stream=None):
    """(count,) numbers of [0, 1) by SplitMix64 (Steele, Lea & Flood 2014), those of the library's
    random streams: the k-th is a mix of seed and k. Streams of a seed are independent."""
    state = np.array([seed % 2**64], np.uint64)
    if stream is not None:
        state = _mix(_mix(state) ^ _mix(~np.array([stream], np.uint64)))
    counts = np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    return (_mix(state + counts) >> np.uint64(11)).astype(np.float64) * 2.0**-53


def figure(path, draw, columns=1, rows=1, size=(6.4, 4.0)):
    """A PNG of `draw(axes)`, or `draw(list of axes)` for several; nothing without matplotlib.

    Returns the line of Markdown that shows it."""
    try:
        import matplotlib
    except ImportError:
        print("holdfast.evaluate: no figures without matplotlib (python3-matplotlib)",
              file=sys.stderr)
        return ""
    matplotlib.use("Agg")
    from matplotlib import pyplot
    made, axes = pyplot.subplots(rows, columns, squeeze=False, layout="constrained",
                                 figsize=(size[0] * columns, size[1] * rows))
    flat = list(axes.flat)
    draw(flat[0] if len(flat) == 1 else flat)
    made.savefig(path, dpi=100, metadata={"Software": None})
    pyplot.close(made)
    return f"![]({path.name})\n"
