#!/usr/bin/env python3
"""How large the code is: lines, files, units and types of the product, lines of tests.

  code_size.py [REVISION]   of the working tree, or of a revision of git

A unit is a header with its source. Lines are those of *.h and *.cpp in geometry, generator, solver, apps,
meshes and python/src.
"""
import pathlib
import re
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PRODUCT = re.compile(r"(geometry|generator|solver|apps|meshes|python/src)/.*\.(h|cpp)$")
TESTS = re.compile(r"tests/.*\.(h|cpp|py)$")
TYPE = re.compile(r"^\s*(?:template\s*<[^;{]*>\s*)?(?:struct|class|enum class|enum)\s+(?:alignas\([^)]*\)\s*)?"
                  r"\w+(?:\s+final)?(?:\s*:[^;{]*)?\s*\{", re.MULTILINE)


def git(*arguments):
    return subprocess.run(["git", *arguments], cwd=ROOT, check=True, capture_output=True).stdout.decode("utf-8", "replace")


def sources(revision):
    """{path: text} of the files that count."""
    names = git("ls-tree", "-r", "--name-only", revision) if revision else git("ls-files")
    wanted = [name for name in names.split("\n") if PRODUCT.match(name) or TESTS.match(name)]
    if revision:
        return {name: git("show", f"{revision}:{name}") for name in wanted}
    return {name: (ROOT / name).read_text(encoding="utf-8", errors="replace") for name in wanted if (ROOT / name).exists()}


def main(revision=None):
    files = sources(revision)
    product = {name: text for name, text in files.items() if PRODUCT.match(name)}
    units, folders = {}, {}
    for name, text in product.items():
        lines = text.count("\n")
        unit = name.rsplit(".", 1)[0]
        units[unit] = units.get(unit, 0) + lines
        folder = name.split("/")[0]
        count, total = folders.get(folder, (0, 0))
        folders[folder] = (count + 1, total + lines)
    print(f"product lines of C++        {sum(units.values()):,}")
    print(f"product files               {len(product):,}")
    print(f"median lines of a unit      {statistics.median(units.values()):.0f}")
    print(f"types                       {sum(len(TYPE.findall(text)) for text in product.values()):,}")
    print(f"lines of tests              {sum(t.count(chr(10)) for n, t in files.items() if TESTS.match(n)):,}")
    for folder, (count, total) in sorted(folders.items()):
        print(f"  {folder:<12}{count:>6} files{total:>10,} lines")


if __name__ == "__main__":
    main(*sys.argv[1:2])
