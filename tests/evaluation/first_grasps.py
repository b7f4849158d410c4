#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The best grasp of every object, as measures and as one picture to judge by eye.

    tests/evaluation/first_grasps.py OUT [--holdfast PROGRAM] [--data FOLDER] [OBJECT ...]

Objects: all 14 of YCB in FOLDER/objects and the 18 embedded ones, or those named. Writes OUT/NAME.npz
of each, OUT/sheet.png (whole person, and the hand from two sides) and OUT/table.csv, and prints the
table. What follows -- is given to `holdfast grasp` as it is: `-- --use any`. Needs Pillow
(python3-pil).
"""
import argparse
import csv
import json
import pathlib
import subprocess
import sys

from PIL import Image, ImageDraw

ROOT = pathlib.Path(__file__).resolve().parents[2]
VIEWS = [["--azimuth", "-45"], ["--camera", "hand"], ["--camera", "hand", "--azimuth", "120"]]
PIXELS = 220
COLUMNS = 4
COLUMNS_OF_TABLE = ["object", "style", "use", "skin_in_object_mm", "object_in_hand_mm", "contact_ratio", "wrench_quality",
                    "upright_cosine", "touching"]


def run(command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True)


def grasp(program, mesh, out, extra):
    """A row of the table and the pictures of one object."""
    name = pathlib.Path(mesh).stem
    clip = out / f"{name}.npz"
    made = run([program, "grasp", mesh, "-o", clip, "-f", "-q", "--json", *extra])
    if made.returncode:
        return {"object": name, "style": made.stderr.strip()}, []
    summary = json.loads(made.stdout)
    row = {"object": name, "contact_ratio": summary["contact"]["contact_ratio"], **summary["grasp"]}
    row["touching"] = " ".join(row["touching"])
    pictures = []
    for k, view in enumerate(VIEWS):
        png = out / f"{name}_{k}.png"
        run([program, "render", clip, "-o", png, "-f", "-q", "--frame", 0, "--size", f"{PIXELS}x{PIXELS}", *view])
        pictures.append(Image.open(png).convert("RGB"))
    return row, pictures


def sheet(made):
    rows = -(-len(made) // COLUMNS)
    picture = Image.new("RGB", (COLUMNS * (3 * PIXELS + 8), rows * PIXELS), "white")
    draw = ImageDraw.Draw(picture)
    for n, (row, pictures) in enumerate(made):
        x, y = n % COLUMNS * (3 * PIXELS + 8), n // COLUMNS * PIXELS
        for k, image in enumerate(pictures):
            picture.paste(image, (x + k * PIXELS, y))
        draw.text((x + 4, y + 2), f"{row['object']}: {row.get('use', '')} {row['style']}", fill="black")
    return picture


def main():
    extra = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("objects", nargs="*")
    parser.add_argument("--holdfast", default=ROOT / "build/release/apps/holdfast")
    parser.add_argument("--data", type=pathlib.Path, default=ROOT / "../shared/data")
    options = parser.parse_intermixed_args(sys.argv[1:len(sys.argv) - len(extra) - bool(extra)])
    meshes = sorted((options.data / "objects").glob("*.obj"))
    meshes += [mesh for mesh in sorted((ROOT / "meshes/objects").glob("*.ply")) if not mesh.stem.endswith("_300")]
    if options.objects:
        meshes = [mesh for mesh in meshes if mesh.stem in options.objects]
    options.out.mkdir(parents=True, exist_ok=True)
    made = [grasp(options.holdfast, mesh, options.out, extra) for mesh in meshes]
    sheet(made).save(options.out / "sheet.png")
    with open(options.out / "table.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS_OF_TABLE, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(row for row, _ in made)
    print((options.out / "table.csv").read_text(), end="")


if __name__ == "__main__":
    main()
