#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Transfers of one demonstration to other objects of the kind, and to scales, as a table and pictures.

    tests/evaluation/transfers.py OUT [--holdfast PROGRAM] [--data FOLDER] [--clip CLIP] [--pictures] [JOB ...]
    tests/evaluation/transfers.py OUT --films [...]
    tests/evaluation/transfers.py OUT --robots [...]

Ten pairs (embedded objects, objects bent by `shape` below, YCB of FOLDER/objects) and six objects at
seven scales from 0.7 to 1.4. Each first object is fitted to CLIP once, with `holdfast fit`. Writes
OUT/JOB of each, OUT/table.csv, and prints the table. JOB: some of them alone, such as mug_025_mug.

--films: the clip with its mug, in 24 frames each, on every right robot hand of FOLDER/robots, with three other
mugs and at three scales, as OUT/film_*.png; and 40 variants of it, a picture each, as OUT/variants.png.

--robots: the tables of docs/robots.md. Six clips on every right robot hand of FOLDER/robots, beside published ways, on one
core (OUT/robots); our way alone on fifteen clips that nothing was chosen on (OUT/other_robots), and the six clips on hands
made of boxes (hands.py, OUT/box_robots). Every clip is played in MuJoCo. Needs the Python module.

Ends with 1 if a command failed.
"""
import argparse
import csv
import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys

import hands

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAIRS = [("mug", "025_mug"), ("mug", "mug_cone"), ("mug", "mug_slim"), ("bottle", "bottle_belly"),
         ("005_tomato_soup_can", "002_master_chef_can"), ("005_tomato_soup_can", "007_tuna_fish_can"),
         ("004_sugar_box", "003_cracker_box"), ("004_sugar_box", "008_pudding_box"),
         ("banana", "011_banana"), ("wineglass", "wineglass_wide")]
SCALED = ["mug", "bottle", "005_tomato_soup_can", "004_sugar_box", "banana", "apple"]
SCALES = [0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.4]
FILMED_MUGS, FILMED_SCALES, FILMED_VARIANTS = ["025_mug", "mug_cone", "mug_slim"], [0.7, 1.2, 1.4], 40
ON_ROBOTS = ["mug", "005_tomato_soup_can", "011_banana", "bottle", "hammer", "apple"]
OTHERS_ON_ROBOTS = ["004_sugar_box", "008_pudding_box", "007_tuna_fish_can", "025_mug", "bowl", "051_large_clamp", "061_foam_brick",
                    "035_power_drill", "040_large_marker", "camera", "flashlight", "knife", "phone", "teapot", "wineglass"]
COLUMNS = ["job", "frames", "held_frames", "deeper_than_2_mm", "deepest_mm", "in_contact_ratio", "searched",
           "clean", "contacts_off_mm", "stretch_p95", "residual_mm"]


def read_ply(path):
    """Vertices and triangles of a binary little-endian PLY as `holdfast` writes it."""
    data = pathlib.Path(path).read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode().splitlines()
    counts = {line.split()[1]: int(line.split()[2]) for line in header if line.startswith("element")}
    vertices = [struct.unpack_from("<3f", data, end + 12 * i) for i in range(counts["vertex"])]
    at, faces = end + 12 * counts["vertex"], []
    size = {"uchar": 1, "uint8": 1}.get(next(l.split()[2] for l in header if l.startswith("property list")), 4)
    for _ in range(counts["face"]):
        faces.append(struct.unpack_from("<3i", data, at + size))
        at += size + 12
    return vertices, faces


def shape(kind):
    """A bend of an object that stands on z = 0: what it does to a point, given the height."""
    def cone(x, y, z, h):
        s = 0.82 + 0.36 * z / h
        return x * s, y * s, 0.95 * z
    def slim(x, y, z, h):
        return 0.88 * x, 0.88 * y, 1.25 * z
    def belly(x, y, z, h):
        u = z / h
        s = 1.0 + 0.5 * max(0.0, u * (0.7 - u)) * 2.0
        return x * s, y * s, 1.05 * z
    def wide(x, y, z, h):
        s = 1.0 + 0.25 * max(0.0, z / h - 0.35)
        return x * s, y * s, 0.9 * z
    return {"cone": cone, "slim": slim, "belly": belly, "wide": wide}[kind]


failed = []  # commands


def run(command):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode:
        print(*command, done.stderr, sep="\n", file=sys.stderr)
        failed.append(command)
    return done


def source_of(name, args):
    scan = args.data / "objects" / f"{name}.obj"
    return scan if scan.exists() else name


def fitted(name, args):
    """The clip with this object held, fitted once."""
    out = args.out / f"held_{name}"
    if not out.exists():
        run([args.holdfast, "fit", args.clip, source_of(name, args), "--drinking", "off", "-o", out, "-q", "--no-report", "--threads", args.threads])
    return out


def target(name, args):
    base, _, kind = name.rpartition("_")
    if kind not in ("cone", "slim", "belly", "wide"):
        return source_of(name, args)
    path = args.out / f"{name}.obj"
    first = fitted(base, args) / "object.ply"
    if not path.exists() and first.exists():  # else the row says what failed
        vertices, faces = read_ply(first)
        height = max(v[2] for v in vertices)
        bent = [shape(kind)(*v, height) for v in vertices]
        path.write_text("".join(f"v {x:.7f} {y:.7f} {z:.7f}\n" for x, y, z in bent) +
                        "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces))
    return path


def transfer(job, source, extra, args):
    out = args.out / job
    done = run([args.holdfast, "transfer", source, "-o", out, "-f", "-q", "--json", "--no-report", "--threads", args.threads, *extra])
    if done.returncode:
        return {"job": job, "frames": done.stderr.strip()}
    result = json.loads(done.stdout)
    summary, holds = result["summary"], result["holds"]
    if args.pictures:
        run([args.holdfast, "render", out, "-o", args.out / f"{job}.png", "-f", "-q", "--sheet", "4x1", "--camera", "hand"])
    frames = json.loads((out / "metrics.json").read_text())["per_frame"]
    depth = frames["penetration_depth_mm"]
    return {"job": job, "frames": len(depth), "held_frames": sum(h != 0 for h in frames["holding_hand"]),
            "deeper_than_2_mm": sum(d > 2.0 for d in depth), "deepest_mm": round(max(depth), 2),
            "in_contact_ratio": summary["frames_in_contact_ratio"],
            "searched": any(h["searched"] for h in holds), "clean": all(h["clean"] for h in holds),
            "contacts_off_mm": round(max(h["contacts_off_mm"] for h in holds), 1),
            "stretch_p95": round(result["map"]["stretch_p95"], 2), "residual_mm": round(result["map"]["residual_mm"], 2)}


def film_transfers(args):
    """The mug's clip with other mugs and at scales."""
    jobs = {f"mug_to_{name}": ["--object", target(name, args)] for name in FILMED_MUGS}
    jobs.update({f"mug_x{scale}": ["--scale", scale] for scale in FILMED_SCALES})
    for job, extra in jobs.items():
        print(*transfer(job, fitted("mug", args), extra, args).values(), flush=True)
        run([args.holdfast, "render", args.out / job, "-o", args.out / f"film_{job}.png", "-f", "-q", "--sheet", "6x4",
             "--size", "420x360", "--camera", "hand", "--threads", args.threads])


def right_hands(args):
    return sorted((args.data / "robots").glob("*/*right.urdf"))


def tabulate_robots(args):
    """What `python3 -m holdfast.evaluate transfer` prints of these lists, times of one core."""
    alone = ["--no-baselines"]
    for name, objects, robots, extra in (("robots", ON_ROBOTS, right_hands(args), []),
                                         ("other_robots", OTHERS_ON_ROBOTS, right_hands(args), alone),
                                         ("box_robots", ON_ROBOTS, hands.write_hands(args.out / "hands"), alone)):
        clips = [fitted(thing, args) for thing in objects]
        done = run([sys.executable, "-m", "holdfast.evaluate", "transfer", *clips, "--robot", *robots, "-o",
                    args.out / name, "--force", "--jobs", 1, "--play", *extra])
        print(done.stdout, end="", flush=True)


def film_robots(args):
    """The mug's clip on robot hands, as `transfer --robot` films it."""
    for robot in right_hands(args):
        out = args.out / f"on_{robot.stem}"
        done = run([args.holdfast, "transfer", fitted("mug", args), "--robot", robot, "-o", out, "-f", "-q",
                    "--threads", args.threads])
        print(done.stdout, end="", flush=True)
        if not done.returncode:
            shutil.copy(out / "film.png", args.out / f"film_{robot.stem}.png")


def picture_variants(args):
    """Variants of the mug's clip, each at another time of it."""
    many, pictures = args.out / "variants", args.out / "variant_pictures"
    pictures.mkdir(exist_ok=True)
    print(run([args.holdfast, "transfer", fitted("mug", args), "--variants", FILMED_VARIANTS, "-o", many, "-q",
               "--threads", args.threads]).stdout, end="")
    rows = [json.loads(line) for line in (many / "manifest.jsonl").read_text().splitlines()]
    frames, kept = rows[0]["frames"], [row for row in rows[1:] if row["kept"]]
    for k, row in enumerate(kept):
        run([args.holdfast, "render", many / row["file"], "-o", pictures / f"{k:02}.png", "-f", "-q", "--camera", "hand",
             "--azimuth", math.degrees(row["yaw_rad"]), "--frame", frames * k // len(kept), "--size", "360x320",
             "--threads", args.threads])
    run(["ffmpeg", "-y", "-loglevel", "error", "-i", pictures / "%02d.png", "-vf", "tile=8x5", "-frames:v", "1",
         "-update", "1", args.out / "variants.png"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("jobs", nargs="*")
    parser.add_argument("--holdfast", default=ROOT / "build/release/apps/holdfast")
    parser.add_argument("--data", type=pathlib.Path, default=ROOT / "../shared/data")
    parser.add_argument("--clip", default="demo_drink")
    parser.add_argument("--threads", default="0")
    parser.add_argument("--pictures", action="store_true")
    parser.add_argument("--films", action="store_true")
    parser.add_argument("--robots", action="store_true")
    args = parser.parse_intermixed_args()
    args.out.mkdir(parents=True, exist_ok=True)
    if args.robots:
        tabulate_robots(args)
    if args.films:
        for film in (film_robots, film_transfers, picture_variants):
            film(args)
    if args.films or args.robots:
        return
    jobs = [(f"{a}_to_{b}", a, lambda b=b: ["--object", target(b, args)]) for a, b in PAIRS]
    jobs += [(f"{a}_x{s}", a, lambda s=s: ["--scale", s]) for a in SCALED for s in SCALES]
    unknown = set(args.jobs) - {job for job, _, _ in jobs}
    if unknown:
        parser.error(f"no such job: {', '.join(sorted(unknown))}. There are {', '.join(job for job, _, _ in jobs)}")
    rows = []
    for job, first, extra in jobs:
        if args.jobs and job not in args.jobs:
            continue
        rows.append(transfer(job, fitted(first, args), extra(), args))
        print(*rows[-1].values(), flush=True)
    with open(args.out / "table.csv", "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, extrasaction="ignore")
        table.writeheader()
        table.writerows(rows)
    measured = [row for row in rows if "deepest_mm" in row]
    deep = sum(row["deeper_than_2_mm"] for row in measured)
    touching = sum(row["in_contact_ratio"] == 1.0 for row in measured)
    print(f"{len(measured)} of {len(rows)} transferred; {deep} of {sum(r['frames'] for r in measured)} frames deeper "
          f"than 2 mm; {touching} in contact in all held frames; {sum(r['searched'] for r in measured)} grasps anew")


if __name__ == "__main__":
    main()
    sys.exit(1 if failed else 0)
