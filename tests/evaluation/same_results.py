#!/usr/bin/env python3
"""Whether two builds of holdfast give the same results: for refactorings that must change nothing.

  same_results.py record PROGRAM FOLDER   runs the commands below into FOLDER
  same_results.py compare FOLDER FOLDER   compares two such folders, byte for byte; exit code 1 on a difference

Wall times (timing.json) are left out, and so is what names the version. Reports (HTML) are not compared.
Captures are those of HOLDFAST_DATA (by default ../shared/data beside the repository).
"""
import json
import os
import pathlib
import subprocess
import sys

DATA = pathlib.Path(os.environ.get("HOLDFAST_DATA",
                                   pathlib.Path(__file__).resolve().parents[2].parent / "shared" / "data"))
WALK = DATA / "mocap/accad_bvh/Female1_B03_Walk1.bvh.gz"
REACH = DATA / "mocap/sb_reach/ChrGarza_IdleStand01_ReachForwardLow01.bvh.gz"
COMMANDS = [
    "fit demo_drink mug -o fit --no-report",
    "fit demo_inspect bottle -o fit_left --hand left --no-report",
    "fit demo_drink mug -o fit_paper --recipe paper --no-report",
    "fit demo_drink mug -o fit_batch --solve batch --no-report",
    f"fit {REACH} {DATA}/objects/025_mug.obj -o fit_captured --end 40 --no-report",
    "offhand demo_pass apple -o offhand --no-report",
    "refine fit_captured/clip.npz -o refine",
    "grasp hammer -o grasp.npz",
    "score fit/clip.npz offhand/clip.npz --json > score.json",
    f"import {WALK} -o walk.npz",
    "decimate teapot -o teapot.ply",
    "export fit/clip.npz -o fit.glb",
    "export fit/clip.npz -o fit.bvh",
    "export fit/clip.npz -o fit.usda",
    "render offhand/clip.npz -o offhand.png --sheet 3x2 --size 160x160",
    "reach --goal 0.5,1.5,1.1 -o reach --no-report",
    "reach --goal 0.5,1.5,1.1 -o reach_optimized --method latent-opt --no-report",
    "reach --goal -0.6,1.2,0.9 --object apple --grasp -o take --no-report",
    "synthesize --action drink --object mug --samples 2 -o synthesize --no-report",
    "doctor fit/clip.npz --json > doctor.json",
]


def without_version(path):
    result = json.loads(path.read_text())
    result.pop("holdfast_version", None)
    return result


def record(program, folder):
    program = pathlib.Path(program).resolve()
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True)
    failed = 0
    for command in COMMANDS:
        done = subprocess.run(f"{program} {command}", shell=True, cwd=folder, stdin=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        print(f"{done.returncode}  {command}")
        if done.returncode:
            failed += 1
            print(done.stderr, file=sys.stderr)
    return 1 if failed else 0


def compare(one, other):
    one, other = pathlib.Path(one), pathlib.Path(other)

    def files(folder):
        return {p.relative_to(folder) for p in folder.rglob("*") if p.is_file() and p.suffix != ".html" and p.name != "timing.json"}

    different = sorted(files(one) ^ files(other))
    for path in sorted(files(one) & files(other)):
        a, b = one / path, other / path
        if a.read_bytes() != b.read_bytes() and (path.suffix != ".json" or without_version(a) != without_version(b)):
            different.append(path)
    for path in different:
        print(f"differs: {path}")
    print(f"{len(files(one) | files(other))} files, {len(different)} differ")
    return 1 if different else 0


if len(sys.argv) != 4 or sys.argv[1] not in ("record", "compare"):
    sys.exit(__doc__)
sys.exit(record(*sys.argv[2:]) if sys.argv[1] == "record" else compare(*sys.argv[2:]))
