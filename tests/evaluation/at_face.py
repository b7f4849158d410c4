#!/usr/bin/env python3
"""How near what `holdfast synthesize` brings to the face comes to its place there, after the fit.

    tests/evaluation/at_face.py [--holdfast PROGRAM] [--seeds 3] [-o FOLDER]

Prints a Markdown table: a row per action and object, millimeters over the seeds.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile

INTENTS = ["drink mug", "drink bottle", "drink wineglass", "drink bowl", "toast wineglass", "toast mug",
           "eat apple", "eat banana", "call phone", "takepicture camera", "takepicture phone",
           "brush toothbrush"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--holdfast", default="build/release/apps/holdfast")
    parser.add_argument("--seeds", type=int, default=3, help="motions of each intent")
    parser.add_argument("-o", "--output", help="keep the motions there")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(options.output or scratch)
        everything = []
        print("| | at the face, mm: mean | most | motions |\n|---|---|---|---|")
        for intent in INTENTS:
            action, thing = intent.split()
            found = []
            for seed in range(1, options.seeds + 1):
                result = folder / f"{action}_{thing}_{seed}"
                made = subprocess.run([options.holdfast, "synthesize", "--action", action, "--object", thing,
                                       "--seed", str(seed), "-o", str(result), "--no-report", "--force", "--quiet"],
                                      capture_output=True, text=True)
                if made.returncode == 3:  # nobody can hold it so, of this seed
                    continue
                made.check_returncode()
                found.append(json.loads((result / "metrics.json").read_text())["synthesis"]["at_face_mm"])
            everything += found
            if found:
                print(f"| {action} {thing} | {statistics.mean(found):.1f} | {max(found):.1f} | {len(found)} |")
        print(f"| all | {statistics.mean(everything):.1f} | {max(everything):.1f} | {len(everything)} |")


if __name__ == "__main__":
    main()
