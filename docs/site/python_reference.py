# SPDX-License-Identifier: MIT
"""Docstrings of the Python module for napoleon: characters with a meaning in RST are text. Signatures
without types, which the docstrings have, with shapes and units."""
import ast
import re


def docstring(app, what, name, object_, options, lines):
    lines[:] = [
        line if line.lstrip().startswith((">>>", "...")) else re.sub(r"[\\*|`]|_\b", r"\\\g<0>", line)
        for line in lines
    ]


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
    app.connect("autodoc-process-docstring", docstring, priority=400)  # before napoleon
    app.connect("autodoc-process-signature", signature)
    return {"parallel_read_safe": True}
