# SPDX-License-Identifier: MIT
"""What packages of the module say of themselves, and that a wheel is one: the build itself is CI's."""
import base64
import email
import hashlib
import importlib.util
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import holdfast

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def packing():
    spec = importlib.util.spec_from_file_location("packing", ROOT / "python" / "packing.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_metadata_is_that_of_the_project(packing):
    told = email.message_from_string(packing.metadata())
    assert (told["Name"], told["Version"]) == ("holdfast", holdfast.__version__)
    assert told.get_all("Requires-Dist")[0] == "numpy" and 'torch ; extra == "torch"' in told.get_all("Requires-Dist")
    assert "GPL-3.0-or-later" in told["License"] and told["Requires-Python"] == ">=3.9"
    assert told.get_payload().startswith("# Holdfast")


def test_a_tree_becomes_a_wheel(packing, tmp_path):
    tree, info = tmp_path / "tree", f"holdfast-{packing.version()}.dist-info"
    (tree / "holdfast").mkdir(parents=True)
    (tree / info).mkdir()
    (tree / "holdfast" / "__init__.py").write_text("answer = 42\n")
    (tree / info / "METADATA").write_text(packing.metadata(), encoding="utf-8")
    name = packing.pack(tree, tmp_path, ("py3", "none", "any"))
    again = (tmp_path / name).read_bytes()
    assert packing.pack(tree, tmp_path, ("py3", "none", "any")) == name and (tmp_path / name).read_bytes() == again
    with zipfile.ZipFile(tmp_path / name) as wheel:
        lines = wheel.read(f"{info}/RECORD").decode().split()
        for path, digest, size in (line.split(",") for line in lines[:-1]):
            content = wheel.read(path)
            assert digest == "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            assert len(content) == int(size)
        assert {line.split(",")[0] for line in lines} == set(wheel.namelist())
    if importlib.util.find_spec("pip"):
        subprocess.run([sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-index", "--target", tmp_path / "site", tmp_path / name],
                       check=True, stderr=subprocess.DEVNULL)
        assert (tmp_path / "site" / "holdfast" / "__init__.py").read_text() == "answer = 42\n"


def test_recipes_are_of_this_version():
    port = json.loads((ROOT / "apps/packages/vcpkg/vcpkg.json").read_text())
    assert port["version"] == holdfast.__version__
    recipe = (ROOT / "apps/packages/conda/meta.yaml").read_text()
    assert f'version: "{holdfast.__version__}"' in recipe
    yaml = pytest.importorskip("yaml")
    plain = yaml.safe_load(re.sub(r"\{\{ (.*?) \}\}", lambda m: m[1].replace('"', ""), recipe))
    assert {"package", "source", "build", "requirements", "test", "about"} == set(plain)
