# SPDX-License-Identifier: MIT
"""The ```python blocks of docs/ and README.md, and examples/, run as they are."""
import ast
import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import holdfast

ROOT = Path(__file__).parents[2]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(holdfast.__file__).parents[1])}
SMALL = {  # arguments of each example: a small job
    "fit_mug": ["demo_drink", "mug", "out"],
    "clean_track": ["--frames", "12"],
    "loss_in_training": ["--steps", "3"],
    "thousand_goals": ["--count", "2"],
    "live_fitting": ["--frames", "12"],
}


def run(folder, *arguments):
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


def blocks_of(page):
    return re.findall(r"^```python\n(.*?)^```", page.read_text(), re.M | re.S)


def missing_modules(source):
    nodes = list(ast.walk(ast.parse(source)))
    names = {alias.name.split(".")[0] for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module.split(".")[0] for node in nodes if isinstance(node, ast.ImportFrom)}
    return {name for name in names if importlib.util.find_spec(name) is None}


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", filter(blocks_of, PAGES), ids=lambda page: str(page.relative_to(ROOT)))
def test_blocks_of(page, has_player, tmp_path):
    blocks = blocks_of(page)
    missing = missing_modules("\n".join(blocks))  # torch, transformers
    blocks = [block for block in blocks if not missing & set(re.findall(r"\w+", block))]
    if not has_player:
        blocks = [block for block in blocks if "holdfast.report(" not in block]
    if blocks:
        (tmp_path / "page.py").write_text("\n".join(blocks))
        run(tmp_path, "page.py")


def test_every_example_is_run():
    in_blender = {"open_in_blender"}  # test "show_gltf_blender"
    assert {path.stem for path in (ROOT / "examples").glob("*.py")} - in_blender == set(SMALL)


@pytest.mark.parametrize("notebook", sorted((ROOT / "examples").glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebook(notebook, has_player, tmp_path, monkeypatch):
    """Its cells in order, and the last value of each as a notebook shows it."""
    monkeypatch.chdir(tmp_path)
    names = {}
    for cell in json.loads(notebook.read_text())["cells"]:
        if cell["cell_type"] != "code" or (not has_player and ".show(" in "".join(cell["source"])):
            continue
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, notebook.name, "exec"), names)
        value = eval(compile(ast.Expression(last.value), notebook.name, "eval"), names) if last else None
        assert not hasattr(value, "_repr_html_") or value._repr_html_().startswith("<iframe")
        assert not cell["outputs"], "clear the outputs before a commit"


@pytest.mark.parametrize("name", SMALL)
def test_example(name, tmp_path):
    if name == "loss_in_training":
        pytest.importorskip("torch")
    assert run(tmp_path, ROOT / "examples" / (name + ".py"), *SMALL[name])
