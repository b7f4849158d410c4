# SPDX-License-Identifier: MIT
"""The commands' reference, made of what `holdfast COMMAND --help` says.

    .. holdfast-commands:: fit offhand grasp

gives each command, and each of its subcommands, a section with its arguments and options. That
every command of the program stands on some page is checked when all are read.
"""
import re
import subprocess

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective
from sphinx.util.nodes import nested_parse_with_titles

COLUMN = 30  # where the program's descriptions begin
SPEC = re.compile(
    r"^(?P<names>\S+)(?: (?P<type>(?!REQUIRED|Needs|Excludes|\.\.\.|\[)[^\s:=]+)"
    r"(?::(?P<check>\{[^}]*\}|[A-Z]+ in \[[^\]]*\]|[A-Z]+))?(?:=(?P<default>\S+))?)?(?P<rest>.*)$"
)
log = logging.getLogger(__name__)


def run_help(program, command):
    return subprocess.run(
        [program, *command.split(), "--help"], check=True, capture_output=True, text=True
    ).stdout.splitlines()


def entries(lines):
    """(heading, [(spec, description)]) of each list of a help, and the lines that are in none."""
    lists, free = [], []
    listing = None
    i = 0
    while i < len(lines):
        line = lines[i]
        if re.fullmatch(r"[A-Z][^.]*:", line) and line != "Examples:":
            listing = (line[:-1], [])
            lists.append(listing)
        elif listing and line.startswith("  ") and line.strip():
            below = i + 1 < len(lines) and lines[i + 1].startswith(" " * COLUMN)
            spec, description = (line, lines[i + 1]) if below else (line[:COLUMN], line[COLUMN:])
            listing[1].append((spec.strip(), description.strip()))
            i += below
        elif listing and not line.strip():
            listing = None
        else:
            free.append(line)
        i += 1
    return lists, free


def literal(text):
    return f"``{text}``"


def escaped(text):
    """The program's text as RST: options and file names as code, nothing else marked."""
    text = re.sub(r"([\\*|_`])", r"\\\1", text)
    return re.sub(r"(?<![\w\\-])(--[a-z][a-z0-9-]*)", r"``\1``\\ ", text)


def entry(spec, description):
    match = SPEC.match(spec)
    names, kind, check = match["names"].replace(",", ", "), match["type"], match["check"] or ""
    rest = match["rest"]
    facts = []
    if check.startswith("{"):
        kind = check
    elif " in " in check:
        low, high = re.search(r"\[(\S+) - (\S+)\]", check).groups()
        facts.append(f"{low} to {high}")
    elif check == "POSITIVE":
        facts.append("above 0")
    elif check == "NONNEGATIVE":
        facts.append("0 or more")
    if match["default"]:
        facts.append("default " + literal(match["default"]))
    if "REQUIRED" in rest:
        facts.append("required")
    if "..." in rest:
        kind = (kind or "") + " ..."
    for word, text in (("Needs", "needs"), ("Excludes", "not with")):
        others = re.search(rf"{word}: ((?:(?!Needs:|Excludes:)\S+ ?)+)", rest)
        if others:
            facts.append(f"{text} " + ", ".join(map(literal, others[1].split())))
    lines = [f".. option:: {names} {kind or ''}".rstrip(), "", f"   {escaped(description)}"]
    if facts:
        lines += ["", "   .. rst-class:: facts", "", f"   {'; '.join(facts)}"]
    return lines + [""]


class Commands(SphinxDirective):
    required_arguments = 1
    final_argument_whitespace = True

    def run(self):
        node = nodes.section(document=self.state.document)
        text = []
        for command in self.arguments[0].split():
            text += self.section(command, "-")
        nested_parse_with_titles(self.state, StringList(text, "holdfast --help"), node)
        return node.children

    def section(self, command, underline):
        documented = getattr(self.env, "holdfast_commands", {})
        documented[command] = self.env.docname
        self.env.holdfast_commands = documented
        lists, free = entries(run_help(self.config.holdfast_program, command))
        usage = next(i for i, line in enumerate(free) if line.startswith("Usage: "))
        examples = free.index("Examples:") if "Examples:" in free else len(free)
        shown, notes = [], []
        for line in free[examples + 1 :]:
            (shown if line.startswith("  ") else notes).append(line)
        text = [f".. _command-{command.replace(' ', '-')}:", "", command, underline * len(command), ""]
        text += [f".. program:: holdfast {command}", ""]
        text += [escaped(line) for line in free[:usage]] + [""]
        text += [".. code-block:: none", "", "   " + free[usage].removeprefix("Usage: "), ""]
        text += [escaped(line) for line in free[usage + 1 : examples]] + [""]
        subcommands = []
        for heading, list_entries in lists:
            if heading == "Subcommands":
                subcommands = [spec for spec, _ in list_entries]
                continue
            list_entries = [e for e in list_entries if not e[0].startswith("-h,")]
            if list_entries:
                text += [f".. rubric:: {heading.replace('Positionals', 'Arguments')}", ""]
            for spec, description in list_entries:
                text += entry(spec, description)
        if any(shown):
            text += [".. rubric:: Examples", "", ".. code-block:: none", ""]
            text += ["   " + line[2:] for line in shown] + [""]
        text += [escaped(line) for line in notes] + [""]
        for name in subcommands:
            text += self.section(f"{command} {name}", "~")
        return text


def check(app, env):
    lists, _ = entries(run_help(app.config.holdfast_program, ""))
    commands = [spec for heading, list_ in lists if heading == "Subcommands" for spec, _ in list_]
    documented = getattr(env, "holdfast_commands", {})
    for command in commands:
        if command not in documented:
            log.warning("no page has 'holdfast %s': add it in docs/reference", command)


def setup(app):
    app.add_config_value("holdfast_program", "holdfast", "env")
    app.add_directive("holdfast-commands", Commands)
    app.connect("env-check-consistency", check)
    return {"parallel_read_safe": False}
