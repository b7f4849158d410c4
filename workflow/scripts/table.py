# SPDX-License-Identifier: MIT
"""All variants and sequences in one table, failures first, then the worst by how deep hand and
object are in each other and how long they are out of contact."""
import csv
import json
import os

VALUES = [
    "frames", "penetration_max_mm", "deep_penetration_frames_ratio", "contact_frames_ratio",
    "intersection_volume_cm3",
]


def load(path):
    try:
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    except (OSError, ValueError):
        return {}


def jobs_of(manifest):
    return {job["name"]: job for job in load(manifest).get("jobs", [])}


def row(variant, group, name, steps, score):
    fault, status = "", "done"
    for step, jobs in steps:
        job = jobs.get(name)
        if job is None or job["status"] != "done":
            status = f"{step} failed"
            fault = (job or {}).get("fault", "")
            break
        fault = fault or job.get("fault", "")
    clip = (score.get("clips") or [{}])[0] if status == "done" else {}
    values = {"frames": clip.get("frames"), **clip.get("values", {})}
    known = {key: values.get(key) if values.get(key) is not None else "" for key in VALUES}
    return {"variant": variant, "group": group, "name": name, "status": status, "fault": fault, **known}


# A centimeter of depth counts as much as no contact in any frame.
def badness(r):
    depth = float(r["penetration_max_mm"] or 0.0)
    lost = 1.0 - float(r["contact_frames_ratio"] or 0.0)
    return (r["status"] == "done", -(depth + 10.0 * lost), r["variant"], r["name"])


def run(job):
    results, rows = job.params.results, []
    for group, names in job.params.groups.items():
        imported = jobs_of(f"{results}/import/{group}/manifest.json")
        for variant in job.params.variants:
            solved = jobs_of(f"{results}/{variant}/solve/{group}/manifest.json")
            scored = jobs_of(f"{results}/{variant}/score/{group}/manifest.json")
            steps = [("import", imported), (group.split("_")[0], solved), ("score", scored)]
            for name in names:
                score = load(f"{results}/{variant}/score/{group}/{name}.json")
                rows.append(row(variant, group, name, steps, score))
    rows.sort(key=badness)
    with open(job.output[0] + ".tmp", "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    os.replace(job.output[0] + ".tmp", job.output[0])


run(snakemake)  # noqa: F821
