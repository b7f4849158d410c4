# SPDX-License-Identifier: MIT
"""Fits of a list of clips and objects by three recipes, and hand-overs found in synthetic clips."""

import pathlib
import statistics

import holdfast
from holdfast.evaluate import _study, handovers

RECIPES = {"paper": "paper's terms", "imos-code": "authors' code", "holdfast": "Holdfast"}

# Name among score's values, label, unit, factor, digits, over the clips, target.
ROWS = [
    ("deep_penetration_frames_ratio", "frames with penetration deeper than 2 mm, both ways", "%",
     100.0, 2, "mean", "under 2 %"),
    ("intersection_volume_cm3", "intersection volume, mean", "cm3", 1.0, 3, "mean", "under 0.3 cm3"),
    ("contact_frames_ratio", "frames in contact", "%", 100.0, 1, "mean", "at least 98 %"),
    ("contact_drift_max_mm", "contact drift, mean of each clip's largest", "mm", 1.0, 2, "mean", ""),
    ("contact_drift_max_mm", "contact drift, worst clip", "mm", 1.0, 2, "worst", "within 2 mm"),
    ("jitter_acceleration_ratio", "object's acceleration over the hand's, mean", "", 1.0, 3, "mean",
     "at most 1.1"),
    ("jitter_acceleration_ratio", "object's acceleration over the hand's, worst clip", "", 1.0, 3,
     "worst", ""),
    ("object_in_body_frames_ratio", "frames with the object deeper than 2 mm in the own body", "%",
     100.0, 2, "mean", "under 1 %"),
    ("object_in_body_max_mm", "object in the own body, worst clip", "mm", 1.0, 1, "worst", ""),
    ("self_penetration_frames_ratio", "frames with hand or forearm deeper than 2 mm in the own body",
     "%", 100.0, 2, "mean", "under 1 %"),
    ("self_penetration_max_mm", "hand or forearm in the own body, worst clip", "mm", 1.0, 1, "worst",
     ""),
]


def value_of(text):
    """A number, numbers (of a point), True or False, or the text."""
    for kind in (int, float):
        try:
            numbers = [kind(word) for word in text.split(",")]
            return numbers[0] if len(numbers) == 1 else numbers
        except ValueError:
            pass
    return {"true": True, "false": False}.get(text, text)


def read_list(path):
    """Jobs of a list: name, clip, object, and the keys as options of holdfast.fit."""
    jobs = []
    for job in holdfast.read_jobs(path):
        if len(job["words"]) != 2:
            raise holdfast.Error(f"{job['where']}: expected a clip and an object, then key=value")
        clip, thing = job["words"]
        options = {key.replace("-", "_"): value_of(text) for key, text in job["keys"].items()}
        if options.get("hand", "auto") == "auto":
            options["hand"] = "right"
        if "contact_threshold" in options:
            options["contact_threshold_mm"] = options.pop("contact_threshold")
        jobs.append({"name": job["name"], "clip": clip, "object": thing, "options": options})
    return jobs


def fit_and_score(job, recipe):
    """Fits one clip, saves it in the study's folder, and scores what was saved."""
    options = dict(job["options"])
    body = _study.body_of(options.pop("body", None))
    folder, clip = pathlib.Path(job["folder"]), job["clip"]
    if recipe != "paper":  # all start from the grasp that the paper's made
        clip = folder / "paper" / job["name"] / "clip.npz"
        options = {key: value for key, value in options.items() if key not in ("start", "end")}
    held = holdfast.fit(clip, job["object"], recipe=recipe, body=body, seed=job["seed"],
                        threads=job["threads"], **options)
    held.save(folder / recipe / job["name"], force=True)
    scores = holdfast.score(folder / recipe / job["name"], body=body, threads=job["threads"])
    return {"values": _study.finite(scores["values"]), "solve_ms": held.contact["solve_ms_median"]}


def fit_clip(job):
    """Fits a clip by all recipes: values and times of each, or its error."""
    results = {}
    for recipe in RECIPES:
        try:
            results[recipe] = fit_and_score(job, recipe)
        except (TypeError, ValueError, holdfast.FitFailure) as error:
            results[recipe] = {"fault": str(error)}
    return results


def over_clips(clips, recipe, row):
    """A row's number of one recipe, in its unit; None if no clip has it."""
    values = [clip[recipe]["values"].get(row[0]) for clip in clips if "values" in clip[recipe]]
    values = [value for value in values if value is not None]
    if not values:
        return None
    return row[3] * (sum(values) / len(values) if row[5] == "mean" else max(values))


def table(clips, found):
    rows = [[row[1], *(_study.fixed(over_clips(clips, recipe, row), row[4], row[2])
                       for recipe in RECIPES), row[6]] for row in ROWS]
    count = found["clips"]
    rows.append(["hand-overs found within 2 frames, object's trajectory with noise", "-", "-",
                 f"{found['found_with_object']} of {count}", "38 of 40"])
    rows.append(["hand-overs found within 2 frames, from the body alone", "-", "-",
                 f"{found['found_without_object']} of {count}", ""])
    return _study.markdown(["", *RECIPES.values(), "target"], rows)


def main(arguments):
    parser = _study.parser(
        "fit", "Compares fits by the paper's terms, its authors' recipe and all terms, each from the "
        "same grasps. Fitted clips are in FOLDER/RECIPE/NAME. Use --jobs 1 to time "
        "one fit at a time.", "fit tests/evaluation/fit.txt -o out/evaluation")
    parser.add_argument("list", type=pathlib.Path,
                        help="file with one job per line, as for 'holdfast fit --batch': CLIP OBJECT "
                        "[key=value ...]; any supported motion file is a clip")
    parser.add_argument("--handovers", type=int, default=40,
                        help="number of synthetic hand-overs to detect (40)")
    options = parser.parse_args(arguments)
    jobs = read_list(options.list)
    question = [options.seed, *([job["options"], _study.contents(job["clip"]),
                                 _study.contents(job["object"])] for job in jobs)]
    store = _study.Store(options.output, "fits", question, options.force)
    threads = max(1, options.jobs // len(jobs))
    parts = {job["name"]: {**job, "folder": str(options.output), "seed": options.seed,
                           "threads": threads} for job in jobs}
    clips = store.run(fit_clip, parts, options.jobs)
    found = handovers.find_synthetic(options.output, options.handovers, options.jobs, options.force)

    summary, faults = {}, []
    for recipe in RECIPES:
        failed = [f"{name}: {clip[recipe]['fault']}" for name, clip in clips.items()
                  if "fault" in clip[recipe]]
        summary[recipe] = {"faults": failed}
        for row in ROWS:
            value = over_clips(clips.values(), recipe, row)
            summary[recipe][f"{row[0]}_{row[5]}"] = None if value is None else value / row[3]
        faults += failed
    entries = [{"name": job["name"], "clip": job["clip"], "object": job["object"],
                **{recipe: clips[job["name"]][recipe].get("values", clips[job["name"]][recipe])
                   for recipe in RECIPES}} for job in jobs]
    times = {recipe: [clip[recipe]["solve_ms"] for clip in clips.values()
                      if "solve_ms" in clip[recipe]] for recipe in RECIPES}
    _study.finish(options.output, {"clips": entries, "summary": summary, "handovers": found},
                  table(clips.values(), found),
                  {f"{recipe}, solve, ms per frame (median of clips)":
                   round(statistics.median_high(of_clips), 2) if of_clips else None
                   for recipe, of_clips in times.items()})
    for fault in faults:
        print(fault)
    return 1 if faults else 0
