#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Captured walks and motions made by each method, side by side.

    tests/bench/naturalness.py --build build/release --captured FOLDER -o out/naturalness

Every method goes to the same goals, around the same frames of the captured clips, one sample each;
then `python3 -m holdfast.evaluate naturalness` compares the folders. Motions that are there already stay.
"""
import argparse
import math
import os
import pathlib
import random
import subprocess


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build/release", type=pathlib.Path)
    parser.add_argument("--captured", required=True, type=pathlib.Path,
                        help="folder of held-out captured clips (.npz): the reference, and starts")
    parser.add_argument("--goals", default=40, type=int, help="motions of each method")
    parser.add_argument("--methods", default="intention,vae-opt,latent-opt")
    parser.add_argument("-o", "--output", default="out/naturalness", type=pathlib.Path)
    options = parser.parse_args()

    program = options.build / "apps/holdfast"
    clips = sorted(options.captured.glob("*.npz"))
    if not clips:
        parser.error(f"{options.captured} has no clip (.npz) in it")
    against = []
    for method in options.methods.split(","):
        folder = options.output / method
        folder.mkdir(parents=True, exist_ok=True)
        against += ["--against", f"{method}={folder}"]
        draw = random.Random(1)
        for number in range(options.goals):
            clip = draw.choice(clips)
            away, angle, height = draw.uniform(1.5, 5.0), draw.uniform(0, 2 * math.pi), draw.uniform(0.3, 1.6)
            target = folder / f"{number:03d}.npz"
            if target.exists():
                continue
            pose = subprocess.run(
                ["/usr/bin/python3", "-c",
                 "import numpy,sys; d=numpy.load(sys.argv[1]); t=d['trans'][min(25,len(d['trans'])-1)];"
                 "print(t[0],t[1])", str(clip)], capture_output=True, text=True, check=True)
            x, y = map(float, pose.stdout.split())
            goal = f"{x + away * math.cos(angle):.3f},{y + away * math.sin(angle):.3f},{height:.3f}"
            made = options.output / "made"
            subprocess.run([program, "reach", f"--goal={goal}", "--from", f"{clip}:25", "--method",
                            method, "--samples", "1", "--no-report", "--quiet", "--force", "-o",
                            made], check=False, stdout=subprocess.DEVNULL)
            (made / "clip.npz").rename(target)
            print(f"{method}: {number + 1}/{options.goals}", flush=True)
    subprocess.run(["/usr/bin/python3", "-m", "holdfast.evaluate", "naturalness", options.captured,
                    *against, "--force", "-o", options.output / "comparison"], check=True,
                   env={"PYTHONPATH": str(options.build / "python"), **os.environ})


if __name__ == "__main__":
    main()
