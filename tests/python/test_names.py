# SPDX-License-Identifier: MIT
"""The stubs, the module and docs/python.md name the same things."""
import ast
import inspect
from pathlib import Path

import pytest

import holdfast
from holdfast import _core

FOLDER = Path(holdfast.__file__).parent


def public(names):
    return {name for name in names if not name.startswith("_")}


def stubs():
    names, classes = set(), {}
    for node in ast.parse((FOLDER / "_core.pyi").read_text()).body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            names.add(node.name)
        if isinstance(node, ast.ClassDef):
            classes[node.name] = node.body
        if isinstance(node, ast.AnnAssign):
            names.add(node.target.id)
    return names, classes


def test_all_names_are_exported():
    assert set(holdfast.__all__) == public(vars(_core)) <= set(vars(holdfast))
    assert holdfast.__version__ and (FOLDER / "py.typed").exists()


def test_stubs_name_everything():
    names, classes = stubs()
    assert public(names) == public(vars(_core))
    for name, body in classes.items():
        members = {getattr(node, "name", None) for node in body}
        members |= {node.target.id for node in body if isinstance(node, ast.AnnAssign)}
        assert public(members - {None}) == public(vars(getattr(_core, name))), name


@pytest.mark.parametrize("name", sorted(public(vars(_core))))
def test_everything_is_documented(name):
    item = getattr(_core, name)
    if not callable(item) or inspect.isclass(item) and issubclass(item, Exception):
        return
    assert len(item.__doc__) > 20
    page = Path(__file__).parents[2] / "docs" / "python.md"
    assert name in page.read_text()
