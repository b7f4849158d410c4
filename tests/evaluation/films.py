#!/usr/bin/env python3
"""Films to look at: sixteen actions and twelve reaches, all drawn from one seed, a sheet of 24 frames each.

    tests/evaluation/films.py [--holdfast PROGRAM] [--seed 1] [--only WORD ...] [-o FOLDER]

Writes FOLDER/NAME/ (what the command made) and FOLDER/NAME.png. Objects of the actions, goals of the
reaches and the seeds of both come from the seed: nobody picks the good ones.
"""
import argparse
import math
import pathlib
import random
import subprocess

ACTIONS = {
    "drink": ["mug", "wineglass", "bottle", "bowl"],
    "eat": ["apple", "banana"],
    "pass": ["mug", "apple", "bottle", "phone", "cube", "teapot"],
    "inspect": ["cube", "lightbulb", "apple", "camera", "flashlight"],
    "lift": ["cube", "bottle", "mug", "teapot", "fryingpan"],
    "call": ["phone"],
    "takepicture": ["camera", "phone"],
    "brush": ["toothbrush"],
    "toast": ["wineglass", "mug"],
    "pour": ["teapot", "bottle", "mug"],
    "offhand": ["bottle", "banana", "apple", "flashlight", "cylinder"],
    "shake": ["bottle", "cylinder"],
    "switchON": ["flashlight"],
    "use": ["hammer"],
    "chop": ["knife"],
    "cook": ["fryingpan"],
}


def actions(draws):
    """Names and command lines of sixteen motions."""
    for action, things in ACTIONS.items():
        thing, seed = draws.choice(things), draws.randrange(1, 10_000)
        yield f"{action}_{thing}", ["synthesize", "--action", action, "--object", thing, "--seed", str(seed)]


def reaches(draws):
    """Names and command lines of twelve motions, goals all around at 0.2 to 1.9 m."""
    for number in range(1, 13):
        angle, away, height = draws.uniform(-math.pi, math.pi), draws.uniform(0.5, 3.0), draws.uniform(0.2, 1.9)
        goal = f"--goal={away * math.cos(angle):.2f},{away * math.sin(angle):.2f},{height:.2f}"
        yield f"reach_{number:02}", ["reach", "--method", "latent-opt", goal, "--seed", str(draws.randrange(1, 10_000))]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--holdfast", default="build/release/apps/holdfast")
    parser.add_argument("--seed", type=int, default=1, help="of which all is drawn")
    parser.add_argument("--only", nargs="*", default=[""], help="those whose name begins so")
    parser.add_argument("-o", "--output", default="out/films")
    options = parser.parse_args()
    folder = pathlib.Path(options.output)
    folder.mkdir(parents=True, exist_ok=True)
    draws = random.Random(options.seed)
    for name, command in [*actions(draws), *reaches(draws)]:
        if not any(name.startswith(word) for word in options.only):
            continue
        result = str(folder / name)
        print(name, " ".join(command), flush=True)
        made = subprocess.run([options.holdfast, *command, "-o", result, "--no-report", "--force", "--quiet"],
                              capture_output=True, text=True)
        if made.returncode != 0:
            print(f"  not made ({made.returncode}): {made.stderr.strip()}")
            continue
        subprocess.run([options.holdfast, "render", result, "-o", result + ".png", "--camera", "follow",
                        "--sheet", "8x3", "--size", "200x256", "--force", "--quiet"], check=True)


if __name__ == "__main__":
    main()
