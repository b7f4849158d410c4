# SPDX-License-Identifier: MIT
"""Writes the stub with the docstrings of the built module, which editors show.

    document_stubs.py MODULE python/holdfast/_core.pyi OUT

The module alone is loaded, not its package, which needs numpy."""
import ast
import importlib.util
import inspect
import sys


def documented(stub, module):
    """The text of the stub with docstrings."""
    lines, inserts = stub.split("\n"), []

    def visit(node, owner):
        item = inspect.getattr_static(owner, node.name, None)
        if not isinstance(item, property):
            item = getattr(owner, node.name, None)
        text = inspect.getdoc(item) if item is not None else None
        first, indent = node.body[0], " " * (node.col_offset + 4)
        setter = any("setter" in ast.unparse(decorator) for decorator in node.decorator_list)
        if text and not setter:
            text = text.replace("\\", "\\\\").replace('"""', "'''")
            quoted = '"""' + text.replace("\n", "\n" + indent) + ("\n" + indent if "\n" in text else "") + '"""'
            line = min([first.lineno] + [one.lineno for one in getattr(first, "decorator_list", ())])
            inserts.append((line - 1, first.col_offset, indent, quoted))
        if isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, (ast.FunctionDef, ast.ClassDef)):
                    visit(member, item)

    for node in ast.parse(stub).body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            visit(node, module)
    for line, column, indent, quoted in sorted(inserts, reverse=True):
        before, body = lines[line][:column].rstrip(), lines[line][column:]
        lines[line] = (before + "\n" if before else "") + indent + quoted + "\n" + indent + body
    return "\n".join(line.rstrip() for line in "\n".join(lines).split("\n"))


def main(module, stub, out):
    spec = importlib.util.spec_from_file_location("_core", module)
    core = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(core)
    with open(stub, encoding="utf-8") as file:
        text = documented(file.read(), core)
    ast.parse(text)
    with open(out, "w", encoding="utf-8") as file:
        file.write(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
