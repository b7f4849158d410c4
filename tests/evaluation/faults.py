#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures of what a viewer sees, over the clips of tests/evaluation/sheets.sh:

  tests/evaluation/faults.py out/sheets [out/sheets_of_another_program ...]

Prints a table with a column for each folder. Environment: HOLDFAST (the program, default
build/release/apps/holdfast); it scores the clips of all folders.
"""
import csv
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

VESSELS = ("bottle", "bowl", "mug", "teapot", "wineglass", "fryingpan")


def scores(folder):
    """The rows of `holdfast score` for the clips in a folder, each with the name of its clip."""
    clips = sorted(path.parent for path in folder.glob("*/clip.npz"))
    program = os.environ.get("HOLDFAST", "build/release/apps/holdfast")
    with tempfile.TemporaryDirectory() as scratch:
        table = Path(scratch) / "score.csv"
        subprocess.run([program, "score", *clips, "--exact", "off", "--csv", table, "-q"],
                       check=True, stdout=subprocess.DEVNULL)
        rows = list(csv.DictReader(table.open()))[:len(clips)]
    for row, clip in zip(rows, clips):
        row["name"] = clip.name
        row["metrics"] = json.loads((clip / "metrics.json").read_text())
    return rows


def values(rows, column):
    return [float(row[column]) for row in rows if row.get(column)]


def frames(rows, column):
    return round(sum(float(row[column] or 0.0) * float(row["frames"]) for row in rows))


def worst(rows, *columns):
    return max((max(values(rows, column), default=0.0) for column in columns), default=0.0)


def above(rows, column, limit):
    return sum(value > limit for value in values(rows, column))


def turns(rows):
    found = sorted(row["metrics"].get("clearance", {}).get("wrist_turn_max_deg", -1.0)
                   for row in rows)
    if not found or found[0] < 0.0:
        return "-"
    return f"{found[int(0.95 * (len(found) - 1))]:.0f} / {found[-1]:.0f}"


def median(rows, column):
    found = values(rows, column)
    return statistics.median(found) if found else float("nan")


def measures(folder):
    fits, made = scores(folder / "fits"), scores(folder / "synthesized")
    vessels = [row for row in made if row["name"].split("_")[-1] in VESSELS]
    body = ("object_in_body_max_mm", "self_penetration_max_mm")
    return {
        "clips": f"{len(fits)}, {len(made)}",
        "hand in the object: worst, mm": f"{worst(fits + made, 'penetration_max_mm'):.1f}",
        "object in mid-air: frames (synthesized)": frames(made, "object_in_mid_air_frames_ratio"),
        "wrist turned by the clearance: 95 % / worst, degrees": turns(fits + made),
        "object or arms more than 10 mm in the body: clips":
            sum(worst([row], *body) > 10.0 for row in fits + made),
        "arms in a table: frames, worst, mm (synthesized)":
            f"{frames(made, 'arms_in_table_frames_ratio')}, "
            f"{worst(made, 'arms_in_table_max_mm'):.0f}",
        "thumb bent by less than 20 degrees: fits":
            sum(value < 20.0 for value in values(fits, "thumb_bend_deg")),
        "thumb's tip off the object: fits": above(fits, "thumb_tip_off_frames_ratio", 0.5),
        "free fingers: mean of the fits": f"{statistics.mean(values(fits, 'free_fingers')):.2f}",
        "vessels at the start: worst tilt, degrees (synthesized)":
            f"{worst(vessels, 'vessel_tilt_start_deg'):.0f}",
        "pelvis, free wrist: median range, mm (synthesized)":
            f"{median(made, 'pelvis_range_mm'):.0f}, {median(made, 'free_wrist_range_mm'):.0f}",
        "head bowed at the start: median, degrees (synthesized)":
            f"{median(made, 'head_down_start_deg'):.0f}",
        "speed at the end: median, m/s (synthesized)": f"{median(made, 'end_speed_m_s'):.3f}",
        "off balance: worst, mm (synthesized)": f"{worst(made, 'off_balance_max_mm'):.0f}",
    }


def main():
    columns = [measures(Path(folder)) for folder in sys.argv[1:]]
    if not columns:
        sys.exit(__doc__)
    print("| |", " | ".join(sys.argv[1:]), "|")
    print("|---" * (len(columns) + 1) + "|")
    for name in columns[0]:
        print(f"| {name} |", " | ".join(str(column[name]) for column in columns), "|")


if __name__ == "__main__":
    main()
