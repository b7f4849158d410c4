# SPDX-License-Identifier: MIT
"""The ```python blocks of docs/python.md and README.md, and examples/, run as they are."""
import importlib.util
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


@pytest.mark.parametrize("page", ["docs/python.md", "README.md"])
def test_blocks_of(page, tmp_path):
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.M | re.S)
    if "import torch" in str(blocks) and importlib.util.find_spec("torch") is None:
        blocks = [block for block in blocks if "torch" not in block]
    if blocks:
        (tmp_path / "page.py").write_text("\n".join(blocks))
        run(tmp_path, "page.py")


def test_every_example_is_run():
    assert {path.stem for path in (ROOT / "examples").glob("*.py")} == set(SMALL)


@pytest.mark.parametrize("name", SMALL)
def test_example(name, tmp_path):
    if name == "loss_in_training":
        pytest.importorskip("torch")
    assert run(tmp_path, ROOT / "examples" / (name + ".py"), *SMALL[name])
