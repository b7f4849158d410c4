# SPDX-License-Identifier: MIT
"""Grasps of objects, simulated by MuJoCo with gravity in six directions."""

import pathlib
import time

import holdfast
from holdfast.evaluate import _study

DIRECTIONS = 6


def usual_objects():
    """The meshes of HOLDFAST_DATA/objects, if the folder exists, and the embedded objects."""
    return (sorted(map(str, _study.data_folder("objects").glob("*.obj")))
            + holdfast.object_names())


def try_first(task):
    """Tries the grasp that holdfast.grasp makes, or returns why there is none."""
    body = _study.body_of(task["body"])
    try:
        held = holdfast.grasp(task["object"], seed=task["seed"], body=body, threads=task["threads"])
    except holdfast.FitFailure as failure:
        return {"fault": str(failure)}
    begin = time.perf_counter()
    trial = holdfast.hold_trial(held, body=body, friction=task["friction"], film=task["film"],
                                force=True, threads=task["threads"])
    protocol = trial.pop("protocol")
    return {"trial": trial, "protocol": protocol, "trial_s": time.perf_counter() - begin}


def try_many(task):
    """Tries distinct grasps of an object: held directions and slips of each."""
    try:
        many = holdfast.grasps(task["object"], task["count"], seed=task["seed"],
                               body=_study.body_of(task["body"]), trial_friction=task["friction"],
                               threads=task["threads"])
    except holdfast.FitFailure:
        return []
    measures = ("held_directions", "worst_slip_mm", "worst_slip_deg")
    return [dict(zip(measures, row)) for row in zip(*(many[key].tolist() for key in measures))]


def summary_of(what, trials, tried):
    """Number of tried grasps that hold in all six directions."""
    held = sum(trial["held_directions"] == DIRECTIONS for trial in trials)
    return {what: tried, "hold_all_six": held, "share": held / max(1, tried)}


def report_first(rows):
    """(values, table, lines of the .csv) of first grasps."""
    lines = []
    for name, row in rows.items():
        if "fault" in row:
            lines.append([name, "-", row["fault"], "", "", ""])
            continue
        trial = row["trial"]
        lines.append([name, str(trial["held_directions"]), f"{trial['worst_slip_mm']:.1f}",
                      f"{trial['worst_slip_deg']:.1f}", f"{trial['settling']['slip_mm']:.1f}",
                      f"{1e3 * trial['mass_kg']:.0f}"])
    objects = [{"object": name, "fault": row.get("fault"), "trial": row.get("trial")}
               for name, row in rows.items()]
    protocol = next((row["protocol"] for row in rows.values() if "protocol" in row), None)
    trials = [row["trial"] for row in rows.values() if "trial" in row]
    head = ["object", f"held of {DIRECTIONS}", "slip, mm", "slip, deg", "settled, mm", "mass, g"]
    return ({"protocol": protocol, "objects": objects,
             "summary": summary_of("objects", trials, len(rows))},
            _study.markdown(head, lines), objects)


def report_many(rows):
    """The same for many grasps of each object."""
    objects = [{"object": name, **summary_of("grasps", trials, len(trials))}
               for name, trials in rows.items()]
    grasps = [{"object": name, "grasp": k, **trial} for name, trials in rows.items()
              for k, trial in enumerate(trials)]
    lines = [[entry["object"], str(entry["grasps"]), str(entry["hold_all_six"]),
              f"{100.0 * entry['share']:.0f}%"] for entry in objects]
    return ({"objects": objects, "summary": summary_of("grasps", grasps, len(grasps))},
            _study.markdown(["object", "grasps", "hold in six", "share"], lines), grasps)


def main(arguments):
    parser = _study.parser(
        "hold", "Simulates grasps in MuJoCo: whether the hand keeps the object with gravity in six "
        "directions. One grasp of each object, or --count distinct grasps. FOLDER/hold.csv has a "
        "line for each grasp.",
        "hold mug bottle -o out/hold")
    parser.add_argument("objects", nargs="*",
                        help="meshes or embedded objects; default: those of HOLDFAST_DATA and all "
                        "embedded ones")
    parser.add_argument("--count", type=int, default=0,
                        help="try this many distinct grasps of each object instead of the first")
    parser.add_argument("--film", type=pathlib.Path,
                        help="write a video (.mp4, .gif) of one object's first grasp")
    parser.add_argument("--body", help="body model in place of the embedded one")
    parser.add_argument("--friction", type=float, default=0.8,
                        help="coefficient of friction of hand and object (0.8)")
    options = parser.parse_args(arguments)
    objects = options.objects or usual_objects()
    if options.film and (len(objects) > 1 or options.count):
        parser.error("--film needs exactly one object, without --count")
    if options.film and options.film.exists() and not options.force:
        parser.error(f"--film: {options.film} exists; --force overwrites it")
    question = [options.seed, options.count, options.friction, bool(options.film),
                options.body and _study.contents(options.body)]
    question += [_study.contents(name) for name in objects]
    store = _study.Store(options.output, "trials", question, options.force)
    task = {"seed": options.seed, "count": options.count, "friction": options.friction,
            "body": options.body, "film": options.film and str(options.film),
            "threads": max(1, options.jobs // len(objects))}
    parts = {pathlib.Path(name).stem: {**task, "object": name} for name in objects}
    if len(parts) < len(objects):
        parser.error("two objects have the same name")
    rows = store.run(try_many if options.count else try_first, parts, options.jobs)
    values, text, lines = (report_many if options.count else report_first)(rows)
    total = values["summary"]
    text += (f"\n{total['hold_all_six']} of {total['grasps' if options.count else 'objects']} hold "
             "in all six directions\n")
    _study.write_csv(options.output / "hold.csv", lines)
    _study.finish(options.output, values, text,
                  {f"{name}, trial, s": round(row["trial_s"], 1) for name, row in rows.items()
                   if "trial_s" in row})
    return 0
