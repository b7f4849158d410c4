# SPDX-License-Identifier: MIT
"""The table as a page: the worst on top, with links to reports and results."""
import csv
import html
import os
import statistics
import urllib.parse

from collections import defaultdict

STYLE = """body{font:15px system-ui,sans-serif;margin:2em auto;max-width:75em;padding:0 1em;color:#222}
table{border-collapse:collapse;width:100%;margin:1em 0}td,th{padding:.35em .7em;text-align:right;border-bottom:1px solid #ddd}
td:first-child,th:first-child,td.t,th.t{text-align:left}tr.bad td{background:#fdecea}small{color:#666}
@media(prefers-color-scheme:dark){body{background:#181a1b;color:#ddd}td,th{border-color:#444}tr.bad td{background:#4a2320}a{color:#8ab4f8}}"""
LABELS = {
    "frames": "frames", "penetration_max_mm": "deepest, mm",
    "deep_penetration_frames_ratio": "deeper than 2 mm, %", "contact_frames_ratio": "in contact, %",
    "intersection_volume_cm3": "volume, cm³",
}


def number(key, text):
    if text == "":
        return "–"
    value = float(text)
    if key.endswith("_ratio"):
        return f"{100 * value:.1f}"
    return f"{value:.0f}" if key == "frames" else f"{value:.2f}"


def link(results, path, text):
    if not os.path.exists(os.path.join(results, path)):
        return html.escape(text) if text else ""
    return f'<a href="{urllib.parse.quote(path)}">{html.escape(text)}</a>'


def summary(rows):
    by_variant = defaultdict(list)
    for row in rows:
        by_variant[row["variant"]].append(row)
    lines = []
    for variant, own in sorted(by_variant.items()):
        done = [row for row in own if row["status"] == "done"]
        cells = [html.escape(variant), str(len(own)), str(len(own) - len(done))]
        for key in list(LABELS)[1:]:
            values = [float(row[key]) for row in done if row[key] != ""]
            cells.append(number(key, str(statistics.fmean(values))) if values else "–")
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    heads = ["variant", "sequences", "failed"] + [f"{LABELS[k]} (mean)" for k in list(LABELS)[1:]]
    return "<table><tr>" + "".join(f"<th>{h}</th>" for h in heads) + "</tr>" + "".join(lines) + "</table>"


def body(rows, results):
    lines = []
    for row in rows:
        solved = f"{row['variant']}/solve/{row['group']}/{row['name']}"
        done = row["status"] == "done"
        said = row["status"] + (f"<br><small>{html.escape(row['fault'])}</small>" if row["fault"] else "")
        cells = [link(results, f"{row['variant']}/report/{row['name']}.html", row["name"]),
                 f'<td class="t">{html.escape(row["variant"])}</td><td class="t">{said}</td>']
        cells += [f"<td>{number(key, row[key])}</td>" for key in LABELS]
        cells.append(f'<td class="t">{link(results, solved + "/metrics.json", "metrics") if done else ""}</td>')
        lines.append(f'<tr{"" if done else " class=bad"}><td>{cells[0]}</td>' + "".join(cells[1:]) + "</tr>")
    heads = "<th>sequence</th><th class=t>variant</th><th class=t>status</th>"
    heads += "".join(f"<th>{label}</th>" for label in LABELS.values()) + "<th></th>"
    return f"<table><tr>{heads}</tr>" + "".join(lines) + "</table>"


def run(job):
    with open(job.input.table, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    failed = sum(row["status"] != "done" for row in rows)
    page = f"""<!doctype html><html lang="en"><meta charset="utf-8"><title>Holdfast: {len(rows)} results</title>
<meta name="viewport" content="width=device-width"><style>{STYLE}</style>
<h1>{len(rows)} results, {failed} failed</h1>
{summary(rows)}
<h2>The worst first</h2><p>Failures, then by depth and lost contact. A name with a link has a report;
<a href="table.csv">table.csv</a> has all columns.</p>
{body(rows, job.params.results)}</html>
"""
    with open(job.output[0] + ".tmp", "w", encoding="utf-8") as file:
        file.write(page)
    os.replace(job.output[0] + ".tmp", job.output[0])


run(snakemake)  # noqa: F821
