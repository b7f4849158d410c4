#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Whole commands from Enter to prompt, and grasps a second, of this build and of an older program in turn.

usage: whole_job.py [--build build/release] [--old PROGRAM] [--rounds 3] [--threads 2] [--count 100] [--no-grasps]
                    [OBJECT ...]

Commands: `fit demo_drink mug` and `offhand demo_pass apple`, seconds by the clock with --threads, and of the
processor (user and system) with one thread. Grasps: `grasp OBJECT --count N` of each object (mug, bottle and
cube if none is given), distinct valid grasps a second beyond those of `--count 1`, so that loading and preparing
the object do not count, of the processor with one thread and by the clock with --threads; --no-grasps where the
older program has no --count. The best of the rounds each. Prints Markdown tables.
"""
import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
COMMANDS = {"fit demo_drink mug": ["fit", "demo_drink", "mug"], "offhand demo_pass apple": ["offhand", "demo_pass", "apple"]}


def run(program, arguments, folder, threads):
    """Seconds of the processor and by the clock, and what is printed."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(
        [program, *arguments, "-o", f"{folder}/out", "-f", "-q", "--json", "--threads", str(threads)],
        capture_output=True, text=True)
    clock, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"whole_job.py: {program} {' '.join(arguments)} failed:\n{done.stderr.strip()}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, clock, json.loads(done.stdout)


def grasps_a_second(program, thing, count, folder, what, threads):
    one = run(program, ["grasp", thing, "--count", "1"], folder, threads)
    many = run(program, ["grasp", thing, "--count", str(count)], folder, threads)
    return (many[2]["found"] - 1) / max(1e-3, many[what == "clock"] - one[what == "clock"])


def best_of(rounds, programs, better, measure):
    """Of each program, in turn, the best of what is measured."""
    best = {}
    for _ in range(rounds):
        for program in programs:
            value = measure(program)
            best[program] = better(best.get(program, value), value)
    return [best[program] for program in programs]


def row(name, values, digits, is_time):
    ratio = values[-1] / values[0] if is_time else values[0] / values[-1]
    shown = f"{values[1]:.{digits}f} | {ratio:.2f}" if len(values) > 1 else "- | -"
    print(f"| {name} | {values[0]:.{digits}f} | {shown} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=HERE.parents[1] / "build" / "release")
    parser.add_argument("--old", help="an older program to compare with")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--no-grasps", action="store_true")
    parser.add_argument("objects", nargs="*", default=["mug", "bottle", "cube"])
    options = parser.parse_args()
    programs = list(filter(None, (str(options.build / "apps" / "holdfast"), options.old)))
    with tempfile.TemporaryDirectory() as folder:
        print("| command | this build, s | the older program, s | ratio |\n|---|---|---|---|")
        for name, arguments in COMMANDS.items():
            for what, threads in (("clock", options.threads), ("processor", 1)):
                values = best_of(options.rounds, programs, min, lambda program: run(
                    program, arguments, folder, threads)[what == "clock"])
                row(f"{name}, {what}", values, 2, True)
        if options.no_grasps:
            return
        print("\n| grasps a second | this build | the older program | ratio |\n|---|---|---|---|")
        for thing in options.objects:
            for what, threads in (("clock", options.threads), ("processor", 1)):
                values = best_of(options.rounds, programs, max, lambda program: grasps_a_second(
                    program, thing, options.count, folder, what, threads))
                row(f"{pathlib.Path(thing).stem}, {what}", values, 0, False)


if __name__ == "__main__":
    main()
