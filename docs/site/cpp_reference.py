# SPDX-License-Identifier: MIT
"""The library's reference, by Doxygen and breathe: the headers that docs/library.md names, and the
terms.

    .. holdfast-headers:: solver/terms/hand/*.h

gives each of them a section.
"""
import re
import shutil
import subprocess
from pathlib import Path

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective
from sphinx.util.nodes import nested_parse_with_titles

DOXYFILE = """
INPUT = {folder}
RECURSIVE = YES
FILE_PATTERNS = *.h
STRIP_FROM_PATH = {folder}
FULL_PATH_NAMES = YES
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_OUTPUT = {folder}/xml
XML_PROGRAMLISTING = NO
EXTRACT_ALL = YES
HIDE_FRIEND_COMPOUNDS = YES
ENABLE_PREPROCESSING = NO
MARKDOWN_SUPPORT = NO
AUTOLINK_SUPPORT = NO
QUIET = YES
WARN_IF_UNDOCUMENTED = NO
WARN_IF_DOC_ERROR = NO
"""


def named_headers(root):
    """Headers of the tables in docs/library.md; 'name.h' alone is in the folder of the one before."""
    headers, folder = [], None
    for name in re.findall(r"`([\w/]+\.h)`", (root / "docs/library.md").read_text()):
        path = root / name if "/" in name else folder / name
        folder = path.parent
        if path not in headers:
            headers.append(path)
    return [str(path.relative_to(root)) for path in headers]


def comment_block(lines):
    """Lines behind '///' as a block, in which what is indented (formulas, lists) is verbatim."""
    block, verbatim = ["/**"], False
    for line in lines:
        inside = line.startswith("   ") or (verbatim and not line)
        if inside != verbatim:
            block.append("@verbatim" if inside else "@endverbatim")
            verbatim = inside
        if not inside:
            line = re.sub(r"[<>](?=\w)|(?<=\w)>", r"\\\g<0>", line)
            line = re.sub(r"`([^`]+)`", r"<tt>\1</tt>", line)
        block.append(line[3:] if inside else line)
    return block + ["@endverbatim"] * verbatim + ["*/"]


def for_doxygen(text):
    if re.search(r"^///", text.split("\nnamespace holdfast", 1)[0], re.M):
        text = re.sub(r"^///", "/// @file\n///", text, count=1, flags=re.M)  # not of what follows
    # Breathe would describe the namespace once a header, and takes no lambda for a default.
    text = re.sub(r"^namespace holdfast \{|^\}  // namespace holdfast$", "", text, flags=re.M)
    text = re.sub(r"(= )\[\](?: ?\([^)]*\))? ?\{[^}]*\}", r"\1{}", text)
    text = re.sub(r"^ private:\n.*?(?=^\};)", "", text, flags=re.M | re.S)
    lines, comment = [], []
    for line in text.split("\n"):
        found = re.match(r"\s*///(?!<)(.*)", line)
        if found:
            comment.append(re.sub(r"/\*|\*/", "/ *", found[1]))
            continue
        if comment:
            lines += comment_block(comment)
            comment = []
        lines.append(line)
    return "\n".join(lines)


def run_doxygen(app):
    if not shutil.which("doxygen"):
        raise ExtensionError("the site needs doxygen: apt-get install doxygen")
    root = Path(app.srcdir)
    folder = Path(app.doctreedir) / "doxygen"
    shutil.rmtree(folder, ignore_errors=True)
    for name in named_headers(root) + [str(p.relative_to(root)) for p in root.glob("solver/terms/*/*.h")]:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(for_doxygen((root / name).read_text()))
    subprocess.run(["doxygen", "-"], input=DOXYFILE.format(folder=folder), text=True, check=True)
    app.config.breathe_projects = {"holdfast": str(folder / "xml")}


class Headers(SphinxDirective):
    """'.. holdfast-headers::' of those that docs/library.md names, or of a pattern."""

    optional_arguments = 1

    def run(self):
        root = Path(self.env.srcdir)
        if self.arguments:
            names = sorted(str(p.relative_to(root)) for p in root.glob(self.arguments[0]))
        else:
            names = named_headers(root)
        text = []
        for name in names:
            self.env.note_dependency(str(root / name))
            text += [name, "-" * len(name), "", f".. doxygenfile:: {name}", ""]
        node = nodes.section(document=self.state.document)
        nested_parse_with_titles(self.state, StringList(text, "docs/library.md"), node)
        return node.children


def setup(app):
    app.add_directive("holdfast-headers", Headers)
    app.connect("builder-inited", run_doxygen, priority=100)
    return {"parallel_read_safe": False}
