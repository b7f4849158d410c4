#!/usr/bin/env python3
"""Refuses spellings and constructions that readers stumble over: in headers, sources, help and docs.

  check_language.py        exit code 1 and a line for each place
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
EVERYWHERE = {  # pattern: what to write
    r"\b\w*(optimi|normali|initiali|summari|recogni|minimi|maximi|lineari|organi|visuali)s(e|ed|es|ing|ation|er)\b": "-ize",
    r"\b\w*([Cc]olour|[Nn]eighbour|[Bb]ehaviour|[Ff]avour)\w*": "color, neighbor, behavior, favor",
    r"\b\w*([Cc]entre|[Mm]etres?\b|[Ll]abelled|[Tt]ravelled|[Mm]odelled|[Aa]rtefact|[Ll]icence)\w*": "American spelling",
    r"\bk(Most|Least)[A-Z]\w*": "kMax..., kMin...",
}
PROSE = {  # of help texts, headers and docs
    r"\bwhat made it\b": "provenance",
    r"\btold by (its|their) content\b": "detected from the content",
    r"\b(is|are) at fault\b": "is invalid",
    r"\bnobody's\b": "free, unconstrained",
    r"\blies about\b": "any supported file",
    r"\bgo(es)? astray\b": "is perturbed",
    r"\bcan(not|'t) be told from\b": "is not significantly different from",
    r"\bsays? so\b": "is reported",
    r"\bg(i|a)ves? way\b": "is adjusted",
    r"\b(are|is) led back\b": "is blended back",
    r"\bas bodies do\b": "physically plausible",
}
SOURCES = re.compile(r"(geometry|generator|solver|apps|python)/.*\.(h|cpp|py)$")
DOCS = re.compile(r"(docs/.*\.(md|rst)|README\.md|meshes/.*\.md|CONTRIBUTING\.md)$")
ALLOWED = {"CHANGELOG.md", "geometry/io/markers/marker_recording.cpp"}  # the latter: units as files name them


def prose_of(name, line):
    """The part of a line that people read: all of a document, comments and texts of code."""
    if DOCS.match(name):
        return line
    return " ".join(re.findall(r'//[^\n]*|"(?:[^"\\]|\\.)*"|#[^\n]*', line))


def main():
    names = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\n")
    found = 0
    for name in names:
        if not (SOURCES.match(name) or DOCS.match(name)) or name in ALLOWED or not (ROOT / name).exists():
            continue
        for number, line in enumerate((ROOT / name).read_text(encoding="utf-8").split("\n"), 1):
            for pattern, better in [*EVERYWHERE.items(), *PROSE.items()]:
                text = line if pattern in EVERYWHERE else prose_of(name, line)
                for match in re.finditer(pattern, text):
                    print(f"{name}:{number}: '{match[0]}': write {better}")
                    found += 1
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
