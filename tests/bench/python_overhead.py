#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What Python costs: a fit as a process from Python against the program's, in pairs one after the other.

usage: python_overhead.py [--build build/release] [--pairs 5]

Both read demo_drink, fit the mug on all cores, and write the clip and the object; neither writes a
report. Prints a Markdown table of wall and CPU time, and checks that both wrote the same bytes. Needs
the Python module (-DHOLDFAST_BUILD_PYTHON=ON).
"""
import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
CODE = "import sys, holdfast; holdfast.fit('demo_drink', 'mug').save(sys.argv[1])"


def timed(command, environment):
    """Wall and CPU time of a process, seconds."""
    begin, before = time.perf_counter(), os.times()
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    cpu = sum(getattr(after, k) - getattr(before, k) for k in ("children_user", "children_system"))
    return time.perf_counter() - begin, cpu


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=HERE.parents[1] / "build" / "release")
    parser.add_argument("--pairs", type=int, default=5)
    arguments = parser.parse_args()
    program, module = arguments.build / "apps" / "holdfast", arguments.build / "python"
    if not program.exists() or not list(module.glob("holdfast/_core*")):
        sys.exit(f"python_overhead.py: {arguments.build} lacks program or module: build with -DHOLDFAST_BUILD_PYTHON=ON, or give --build")
    environment = dict(os.environ, PYTHONPATH=str(module.resolve()))
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        ways = {
            "program": [program, "fit", "demo_drink", "mug", "-o", folder / "program", "--no-report", "--quiet", "--force"],
            "Python": [sys.executable, "-c", CODE, folder / "python"],
        }
        times = {way: [] for way in ways}
        for pair in range(-1, arguments.pairs):  # the first reads the files from the disk
            for way in list(ways)[:: 1 if pair % 2 else -1]:
                took = timed(ways[way], environment)
                if pair >= 0:
                    times[way].append(took)
        same = all((folder / "program" / f).read_bytes() == (folder / "python" / f).read_bytes() for f in ("clip.npz", "object.ply"))
        imports = statistics.median(timed([sys.executable, "-c", "import holdfast"], environment)[0] for _ in range(5))
    if not same:
        sys.exit("python_overhead.py: program and Python wrote different files")
    print(f"| fit demo_drink mug, {arguments.pairs} pairs, s: median (least) | program | Python | median of ratios |")
    print("|---|---|---|---|")
    for k, clock in enumerate(("wall time", "CPU time")):
        columns = [[took[k] for took in times[way]] for way in ways]
        cells = [f"{statistics.median(c):.2f} ({min(c):.2f})" for c in columns]
        ratio = statistics.median(theirs / mine for mine, theirs in zip(*columns))
        print(f"| {clock} | {cells[0]} | {cells[1]} | {ratio:.3f} |")
    print(f"\nOf that, starting Python and importing the module: {imports:.2f} s; the files written are the same, byte for byte.")


if __name__ == "__main__":
    main()
