# SPDX-License-Identifier: MIT
"""One group of sequences by `holdfast COMMAND --batch`: a sequence that fails is recorded in the
manifest and ends nothing; a group that was killed goes on where it was."""
import csv
import json
import os
import shlex
import shutil
import subprocess
import sys

FAILED_AND_SAID_SO = (0, 1, 3)


def program(config):
    built = "build/release/apps/holdfast"
    found = config.get("holdfast") or (built if os.path.exists(built) else shutil.which("holdfast"))
    if not found:
        sys.exit("holdfast workflow: no program: ./setup workflow builds it, or give holdfast: in the config")
    return found


def worst_of(table, variant, count, results):
    """Lines of the report's list: the worst results of a variant that there are."""
    with open(table, newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["variant"] == variant and row["status"] == "done"]
    return [f'"{results}/{variant}/solve/{row["group"]}/{row["name"]}" "name={row["name"]}"' for row in rows[:count]]


def done_lines(lines, manifest):
    """Lines of those sequences that the step before did."""
    if manifest is None:
        return lines
    with open(manifest, encoding="utf-8") as file:
        names = [job["name"] for job in json.load(file)["jobs"] if job["status"] == "done"]
    return [line for line in lines if any(f'"name={name}"' in line for name in names)]


def run(job):
    folder = os.path.dirname(job.output[0])
    command = job.params.command
    if command == "report":
        lines = worst_of(job.input[0], job.wildcards.variant, job.params.worst, job.params.results)
    else:
        lines = done_lines(job.params.lines, job.input[0] if len(job.input) else None)
    os.makedirs(os.path.dirname(folder), exist_ok=True)
    if not lines:  # nothing was left to do
        os.makedirs(folder, exist_ok=True)
        with open(job.output[0], "w", encoding="utf-8") as file:
            json.dump({"schema": "holdfast/batch/1", "kind": command, "jobs": [], "failed": 0}, file)
        return
    # Its own name while it is written; relative paths in it are the workflow's.
    listed = os.path.join(os.path.dirname(folder), os.path.basename(folder) + ".txt")
    with open(listed + ".tmp", "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
    os.replace(listed + ".tmp", listed)
    call = [program(job.config), command, "--batch", listed, "-o", folder, "--threads", str(job.threads)]
    call += shlex.split(job.params.options or "")
    code = subprocess.call(call)
    if code not in FAILED_AND_SAID_SO or not os.path.exists(job.output[0]):
        sys.exit(code or 1)


run(snakemake)  # noqa: F821
