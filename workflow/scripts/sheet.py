# SPDX-License-Identifier: MIT
"""The sample sheet, its groups, and lines of job lists made of it."""
import csv
import difflib
import itertools
import os
import sys

REQUIRED = ["motion"]
# Columns that become options of import, of fit or refine.
IMPORT_KEYS = ["fps", "up", "person", "body"]
SOLVE_KEYS = ["hand", "start", "end", "object-scale"]
# What those cells may hold: a wrong one would fail the whole group's list, and only when its turn has come.
HANDS = {"fit": ("auto", "right", "left", "both"), "refine": ("auto", "clip", "right", "left", "both")}
UPS = ("x", "y", "z", "-x", "-y", "-z")
NUMBERS = {
    "fps": (float, lambda v: 0 <= v <= 1000, "a frame rate from 0 to 1000"),
    "object-scale": (float, lambda v: 0 < v < float("inf"), "a positive number"),
    "person": (int, lambda v: v >= 0, "a whole number from 0"),
    "start": (int, lambda v: v >= 0, "a frame from 0"),
    "end": (int, lambda v: v >= -1, "a frame, or -1"),
}
COLUMNS = REQUIRED + ["name", "job", "object"] + IMPORT_KEYS + SOLVE_KEYS


class SheetError(Exception):
    pass


def data_folder(given):
    return given or os.environ.get("HOLDFAST_DATA") or "../shared/data"


def _find(word, folders):
    """The file, relative to the sheet or the data, or None."""
    for folder in folders:
        if os.path.exists(os.path.join(folder, word)):
            return os.path.join(folder, word)
    return None


def _rows(path):
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            first = next((line for line in file if line.strip() and not line.startswith("#")), "")
            file.seek(0)
            delimiter = "\t" if "\t" in first else ","
            rows = csv.reader(file, delimiter=delimiter, strict=True)
            for cells in rows:
                yield rows.line_num, cells
    except OSError as error:
        raise SheetError(f"{path}: cannot be read ({error.strerror}). Give samples: in the config")
    except csv.Error as error:
        raise SheetError(f"{path}:{rows.line_num}: does not read ({error}). Close its quotes")
    except UnicodeDecodeError:
        raise SheetError(f"{path}: is not UTF-8. Save it as UTF-8")


def _header(path, cells):
    for column in cells:
        if column not in COLUMNS:
            near = difflib.get_close_matches(column, COLUMNS, 1)
            raise SheetError(f"{path}:1: has a column '{column}'. " + (f"Did you mean '{near[0]}'? " if near else "") + "Columns are " + ", ".join(COLUMNS))
    for column in REQUIRED:
        if column not in cells:
            raise SheetError(f"{path}:1: has no column '{column}'. Columns are " + ", ".join(COLUMNS))
    for column in cells:
        if cells.count(column) > 1:
            raise SheetError(f"{path}:1: has the column '{column}' twice. Keep one of them")


def _check_values(sample, where):
    for key, (kind, may_be, what) in NUMBERS.items():
        text = sample.get(key)
        try:
            if text and not may_be(kind(text)):
                raise ValueError
        except ValueError:
            raise SheetError(f"{where}: {key} '{text}' is not {what}")
    for key, choices in (("hand", HANDS[sample["job"]]), ("up", UPS)):
        if sample.get(key) and sample[key] not in choices:
            raise SheetError(f"{where}: {key} '{sample[key]}' is none of {', '.join(choices)}")


def _check(sample, where, folders, names):
    job = sample.get("job") or "fit"
    if job not in ("fit", "refine"):
        raise SheetError(f"{where}: job '{job}' is neither fit nor refine")
    sample["job"] = job
    _check_values(sample, where)
    motion = _find(sample["motion"], folders)
    if not sample["motion"] or motion is None:
        raise SheetError(f"{where}: '{sample['motion']}' is not there. Looked in {', '.join(folders)}")
    name = sample.get("name") or os.path.basename(sample["motion"]).split(".")[0]
    if "/" in name or name.startswith(".") or '"' in name:
        raise SheetError(f"{where}: name '{name}' is not a file name. Use one without slashes and quotes")
    if name in names:
        raise SheetError(f"{where}: repeats the name '{name}' of line {names[name]}. Give each row another name")
    sample["motion"], sample["name"] = motion, name
    if sample.get("object"):
        word = sample["object"]
        found = _find(word, folders)
        if found is None and ("/" in word or "." in word):
            raise SheetError(f"{where}: '{word}' is not there. Looked in {', '.join(folders)}")
        sample["object"] = found or word  # else an embedded object
    elif job == "fit":
        raise SheetError(f"{where}: has no object to fit. Name a mesh or an embedded object")


def read(path, data=None):
    """The sheet's samples, in its order. Stops with one line that says what is wrong and where."""
    try:
        return _read(path, data_folder(data))
    except SheetError as error:
        sys.exit(f"holdfast workflow: {error}")


def _read(path, data):
    folders = [os.path.dirname(path) or ".", data]
    columns, samples, names = None, [], {}
    for number, cells in _rows(path):
        cells = [cell.strip() for cell in cells]
        if any("\n" in cell or "\r" in cell for cell in cells):
            raise SheetError(f"{path}:{number}: has a line break in a cell. Close its quotes")
        if not any(cells) or cells[0].startswith("#"):
            continue
        if columns is None:
            _header(path, cells)
            columns = cells
            continue
        where = f"{path}:{number}"
        if len(cells) > len(columns) and any(cells[len(columns):]):
            raise SheetError(f"{where}: has {len(cells)} cells for {len(columns)} columns. Quote cells that hold the separator")
        sample = dict(zip(columns, cells))
        _check(sample, where, folders, names)
        names[sample["name"]] = number
        samples.append(sample)
    if not samples:
        raise SheetError(f"{path}: has no row below its header")
    return samples


def groups(samples, size):
    """Chunks of the sheet for each kind of job: rows added at its end change the last chunk alone."""
    if size < 1:
        sys.exit("holdfast workflow: group_size is not 1 or more")
    chunks = {}
    for job in ("fit", "refine"):
        own = [s for s in samples if s["job"] == job]
        for begin in range(0, len(own), size):
            chunks[f"{job}_{begin // size:04d}"] = own[begin:begin + size]
    return chunks


def variants(options, sweep):
    """Options of fit and refine for each combination of the sweep."""
    axes = [(command, key, values) for command, keys in sweep.items() for key, values in keys.items()]
    if any(command not in ("fit", "refine") for command, _, _ in axes):
        sys.exit("holdfast workflow: sweep: is over options of fit or refine")
    result = {}
    for values in itertools.product(*[values for _, _, values in axes]):
        name = ",".join(f"{key}={value}" for (_, key, _), value in zip(axes, values)) or "default"
        own = {command: options.get(command, "") or "" for command in ("fit", "refine")}
        for (command, key, _), value in zip(axes, values):
            own[command] += f" --{key} {value}"
        result[name.replace("/", "_")] = own
    return result


def _quoted(word):
    if '"' in word or "\n" in word:
        sys.exit(f"holdfast workflow: '{word}' has a quote in its name. Rename it")
    return f'"{word}"'


def _line(words, name, sample=None, keys=()):
    parts = [_quoted(os.path.abspath(w) if os.path.exists(w) else w) for w in words]
    parts += [_quoted(f"{key}={sample[key]}") for key in keys if sample.get(key)]
    return " ".join(parts + [_quoted(f"name={name}")])


def import_line(sample):
    return _line([sample["motion"]], sample["name"], sample, IMPORT_KEYS)


# Of results that are made by the workflow, paths stay as they are: relative to its folder.
def solve_line(sample, imported):
    clip = f"{imported}/{sample['name']}.npz"
    keys = SOLVE_KEYS if sample["job"] == "fit" else ["hand", "object-scale"]
    words = [clip]
    extra = f' {_quoted("object=" + os.path.abspath(sample["object"]))}' if sample["job"] == "refine" and sample.get("object") else ""
    if sample["job"] == "fit":
        words.append(sample["object"])
    return _line(words, sample["name"], sample, keys) + extra


def score_line(sample, solved):
    return _line([f"{solved}/{sample['name']}"], sample["name"])
