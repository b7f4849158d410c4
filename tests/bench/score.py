#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Frames a second of `holdfast score`, of this build and of an older program in turn.

usage: score.py [--build build/release] [--old PROGRAM] [--rounds 3] [CLIP ...]

Without clips two fits are made first: the demo's mug, and a cube in both hands. Times are those of
the processor (user and system) with --threads 1, the least of the rounds, starting and loading
included. Prints a Markdown table.
"""
import argparse
import pathlib
import resource
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent


def seconds(program, clip):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, "score", clip, "--threads", "1", "--json"], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"score.py: {program} score {clip} failed:\n{done.stderr.strip()}")
    frames = int(done.stderr.split("scored ")[1].split()[0])
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, frames


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=HERE.parents[1] / "build" / "release")
    parser.add_argument("--old", help="an older program to compare with")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("clips", nargs="*")
    options = parser.parse_args()
    program = str(options.build / "apps" / "holdfast")
    with tempfile.TemporaryDirectory() as folder:
        clips = options.clips
        if not clips:
            for name, more in (("mug", []), ("cube", ["--hand", "both"])):
                clips.append(f"{folder}/{name}")
                subprocess.run([program, "fit", "demo_drink", name, "-o", clips[-1], "--no-report", "-q", *more],
                               check=True, stdout=subprocess.DEVNULL)
        print("| clip | frames | this build, frames a second | the older program | ratio |\n|---|---|---|---|---|")
        for clip in clips:
            best = {}
            for _ in range(options.rounds):
                for one in filter(None, (program, options.old)):
                    spent, frames = seconds(one, clip)
                    best[one] = min(best.get(one, spent), spent)
            ours = frames / best[program]
            old = frames / best[options.old] if options.old else None
            shown = f"{old:.0f} | {ours / old:.1f}" if old else "- | -"
            print(f"| {pathlib.Path(clip).name} | {frames} | {ours:.0f} | {shown} |")


if __name__ == "__main__":
    main()
