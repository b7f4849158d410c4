# SPDX-License-Identifier: MIT
"""Docstrings of the Python module, which are plain text, as RST; signatures without their types,
which the text has, with shapes and units."""
import ast
import re

CODE = re.compile(r"    |>>> |[\w, ]+ = \w[\w.]*\(")


def plain(text, names):
    text = re.sub(
        r"`(\w+)`|([\\*|`]|_\b)", lambda m: f"``{m[1]}``" if m[1] else "\\" + m[2], text
    )

    def bold(match):
        if not all(name in names for name in re.split(r",\s+", match[1])):
            return match[0]
        return re.sub(r"\w+", r"**\g<0>**", match[1]) + match[2]

    return re.sub(r"(?:(?<=\. )|(?<=; )|^)(\w+(?:,\s+\w+)*)(:\s)", bold, text)


def docstring(app, what, name, object_, options, lines):
    found = re.match(r"\w+\((.*)\) ->", (object_.__doc__ or "").split("\n")[0])
    names = re.findall(r"(\w+):", found[1]) if found else ()
    paragraphs = re.split(r"\n\s*\n", "\n".join(lines).strip("\n"))
    text = []
    for paragraph in paragraphs:
        if CODE.match(paragraph):
            text += [".. code-block:: python", ""]
            indent = "" if paragraph.startswith("    ") else "    "
            text += [indent + line for line in paragraph.split("\n")] + [""]
        else:
            text += plain(paragraph, names).split("\n") + [""]
    lines[:] = text


def signature(app, what, name, object_, options, arguments, returned):
    if not arguments:
        return None
    try:
        function = ast.parse(f"def f{arguments}: pass").body[0]
    except SyntaxError:
        return None
    for argument in ast.walk(function):
        if isinstance(argument, ast.arg):
            argument.annotation = None
    function.args.posonlyargs = [a for a in function.args.posonlyargs if a.arg != "self"]
    function.args.args = [a for a in function.args.args if a.arg != "self"]
    return f"({ast.unparse(function.args)})", ""


def setup(app):
    app.connect("autodoc-process-docstring", docstring)
    app.connect("autodoc-process-signature", signature)
    return {"parallel_read_safe": True}
