#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""How much each weight of the fit changes the result, with sums and with means.

    tests/evaluation/weights.py --holdfast build/release/apps/holdfast [--jobs JOBS.txt] [-o TABLE.md]

A grasp is made once for each job; every row fits with it (--keep-grasp) and other weights. Columns are
means over the jobs: how far the object is from the first row's at most, and what `score` measures.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

import numpy as np

JOBS = ["demo_drink mug drinking=off", "demo_drink bottle drinking=off", "demo_inspect apple", "demo_inspect teapot",
        "demo_drink hammer", "demo_inspect camera"]
WEIGHTS = {"contact": 0.005, "temporal": 0.005, "penetration": 3000.0, "object-in-hand": 3000.0,
           "limits": 100.0}
MEASURES = {"contact_drift_mm": "contact drift, mm", "penetration_mean_max_mm": "depth, mm",
            "jitter_acceleration_ratio": "jitter, ratio",
            "jitter_angular_acceleration_ratio": "angular jitter, ratio"}


def rows():
    yield "sum", "", []
    for name in ("contact", "temporal"):
        yield "sum", f"{name} x 0", [f"--lambda-{name}", "0"]
        yield "sum", f"{name} x 1000", [f"--lambda-{name}", str(1000 * WEIGHTS[name])]
    yield "mean", "", []
    for name in ("contact", "temporal"):
        for factor in (0, 0.1, 10):
            yield "mean", f"{name} x {factor:g}", [f"--lambda-{name}", str(factor * WEIGHTS[name])]
    for name in ("penetration", "object-in-hand", "limits"):
        for factor in (0, 0.1, 10):
            yield "sum", f"{name} x {factor:g}", [f"--lambda-{name}", str(factor * WEIGHTS[name])]


def turns(orient):
    angle = np.linalg.norm(orient, axis=1)
    axis = orient / np.maximum(angle, 1e-12)[:, None]
    return np.column_stack([np.cos(angle / 2), np.sin(angle / 2)[:, None] * axis])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--holdfast", required=True)
    parser.add_argument("--jobs", help="a file with CLIP OBJECT in each line")
    parser.add_argument("-o", "--output")
    arguments = parser.parse_args()
    jobs = pathlib.Path(arguments.jobs).read_text().splitlines() if arguments.jobs else JOBS

    def run(*command):
        return subprocess.run([arguments.holdfast, *map(str, command), "-q"], check=False,
                              capture_output=True, text=True)

    lines = ["| weights multiply | changed | object moved, mm | turned, deg | "
             + " | ".join(MEASURES.values()) + " |", "|---|---|" + "---|" * (2 + len(MEASURES))]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for k, job in enumerate(jobs):
            done = run("fit", *job.split()[:2], "-o", folder / f"grasp{k}", "--no-report")
            if done.returncode not in (0, 3):
                raise SystemExit(f"{job}: {done.stderr}")
        first = None
        for normalize, changed, options in rows():
            poses, values = [], []
            for k, job in enumerate(jobs):
                out = folder / "fit"
                done = run("fit", folder / f"grasp{k}" / "clip.npz", folder / f"grasp{k}" / "object.ply",
                           "--keep-grasp", "--keep-motion", "--normalize", normalize, *options,
                           "-o", out, "--force", "--no-report")
                if done.returncode not in (0, 3):
                    raise SystemExit(f"{job}: {done.stderr}")
                clip = np.load(out / "clip.npz")
                poses.append((clip["object_trans"], turns(clip["object_orient"])))
                score = json.loads(run("score", out, "--json").stdout)["clips"][0]["values"]
                values.append([score[name] for name in MEASURES])
            first = first or poses
            moved = [1e3 * np.linalg.norm(a[0] - b[0], axis=1).max() for a, b in zip(poses, first)]
            turned = [np.degrees(2 * np.arccos(np.clip(np.abs((a[1] * b[1]).sum(1)), 0, 1))).max()
                      for a, b in zip(poses, first)]
            numbers = [np.mean(moved), np.mean(turned), *np.mean(values, axis=0)]
            lines.append(f"| {normalize} | {changed} | " + " | ".join(f"{n:.3f}" for n in numbers) + " |")
            print(lines[-1], flush=True)
    if arguments.output:
        pathlib.Path(arguments.output).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
