#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""One hand, one object, the paper's three terms, by every way there is, in one run on one machine.

usage: compare.py [--build build/release] [--frames 12] [--json FILE]

Prints a Markdown table: time per frame, how many times that of Holdfast, and the energy that is
left over the optimum's. Needs holdfast_fit_methods (cmake --preset release builds it) and, for the
baselines, Debian's python3-torch and python3-scipy (./setup bench installs them). Takes three to
four minutes.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent


def run(name, command):
    begin = time.monotonic()
    print(f"{name} ...", file=sys.stderr, end="", flush=True)
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    print(f" {time.monotonic() - begin:.0f} s", file=sys.stderr)
    if done.returncode != 0:
        sys.exit(f"compare.py: {name} failed:\n{done.stderr.strip()}")
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=HERE.parents[1] / "build" / "release")
    parser.add_argument("--frames", type=int, default=12, help="frames fitted by each (default %(default)s)")
    parser.add_argument("--json", type=pathlib.Path, help="write all that was measured here")
    parser.add_argument("--python", default="/usr/bin/python3", help="the one that has torch and scipy")
    options = parser.parse_args()
    program = options.build / "tests" / "bench" / "holdfast_fit_methods"
    if not program.exists():
        sys.exit(f"compare.py: no {program}: build with -DHOLDFAST_BUILD_BENCHMARKS=ON, or give --build")
    with tempfile.TemporaryDirectory() as folder:
        scene = pathlib.Path(folder) / "scene.npz"
        ours = run("plain Ceres, Holdfast, the recipe in C++", [program, options.frames, scene])
        script = lambda name, *more: [options.python, HERE / f"baseline_{name}.py", scene, *more]
        torch = {
            (steps, rate): run(f"PyTorch, {steps} steps of Adam at {rate:g}", script("torch", steps, "--rate", rate))
            for steps, rate in [(160, 5e-3), (160, 1e-3), (1200, 1e-3)]
        }
        recipe = run("the authors' recipe in Python", script("scipy"))

    rows = [("every pair a residual, Ceres, 2 threads", ours["plain"])]
    rows += [(f"PyTorch, cdist, {steps} Adam steps at {rate:g}", found) for (steps, rate), found in torch.items()]
    rows += [
        ("the authors' recipe, SciPy + 160 Adam steps", recipe),
        ("the same recipe, `--recipe imos-code`", ours["imos_code"]),
        ("Holdfast, pair loop in double", ours["double"]),
        ("Holdfast, pair loop in single", ours["single"]),
    ]
    best = ours["plain"]["energies"]
    fastest = statistics.median(ours["single"]["ms"])
    pairs = ours["hand_vertices"] * ours["object_vertices"]
    print(
        f"\n{ours['hand_vertices']} hand vertices, {ours['object_vertices']} object vertices, {pairs:,} pairs, "
        f"{options.frames} frames, {os.cpu_count()} cores, PyTorch {next(iter(torch.values()))['torch']} "
        f"({next(iter(torch.values()))['threads']} threads), SciPy {recipe['scipy']}\n"
    )
    print("| way | ms per frame (median) | times Holdfast's | energy over the optimum's |")
    print("|---|---|---|---|")
    for name, found in rows:
        ms = statistics.median(found["ms"])
        above = statistics.mean(e / b - 1 for e, b in zip(found["energies"], best))
        if found is ours["plain"]:
            excess = "1 (taken as the optimum)"
        else:
            excess = f"1 {above:+.0e}" if abs(above) < 0.1 else f"{1 + above:,.0f}"
        shown = f"{ms:.3f}" if ms < 10 else f"{ms:,.0f}"
        print(f"| {name} | {shown} | {ms / fastest:,.{1 if ms < 10 * fastest else 0}f} | {excess} |")
    if options.json:
        ours["torch"] = [{"steps": s, "rate": r, **found} for (s, r), found in torch.items()]
        ours["imos_code_python"] = recipe
        options.json.write_text(json.dumps(ours, indent=1) + "\n")


if __name__ == "__main__":
    main()
