# SPDX-License-Identifier: MIT
"""The stubs, the module and docs/python.md name the same things."""
import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import holdfast
from holdfast import _core
from support import refused

FOLDER = Path(holdfast.__file__).parent
ROOT = Path(__file__).parents[2]


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


def test_stubs_have_the_docstrings():
    """Of the module as built; the stub of the sources has none."""
    for node in ast.parse((FOLDER / "_core.pyi").read_text()).body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            assert ast.get_docstring(node) == inspect.getdoc(getattr(_core, node.name)), node.name


def documented():
    """Everything public that takes arguments or has a meaning of its own: no exceptions."""
    items = {name: getattr(_core, name) for name in public(vars(_core))}
    return {name: item for name, item in items.items()
            if callable(item) and not (inspect.isclass(item) and issubclass(item, Exception))}


@pytest.mark.parametrize("name", sorted(public(vars(_core))))
def test_everything_is_on_the_page_and_tested(name):
    word = re.compile(rf"\b{name}\b")
    assert word.search((ROOT / "docs" / "python.md").read_text())
    tests = [path.read_text() for path in Path(__file__).parent.glob("test_*.py")]
    # Results are made by what is named.
    assert name.endswith("Result") or any(word.search(text) for text in tests)


@pytest.mark.parametrize("name", sorted(documented()))
def test_everything_is_documented(name):
    assert len(documented()[name].__doc__) > 20


def signatures():
    """(dotted name, node of the stub) of every function and method; of overloads the last."""
    found = {}
    for node in ast.parse((FOLDER / "_core.pyi").read_text()).body:
        for member in node.body if isinstance(node, ast.ClassDef) else [node]:
            if isinstance(member, ast.FunctionDef) and not any(
                    word in ast.unparse(member) for word in ("@property", ".setter")):
                found[".".join([node.name] + ([member.name] if member is not node else []))] = member
    return found


def found(path):
    item = _core
    for part in path.split("."):
        item = getattr(item, part)
    return item


def docstring(path):
    """Of a function or method; of a constructor that of its class."""
    return inspect.cleandoc(found(path.removesuffix(".__init__")).__doc__ or "")


def entries(text):
    """{name: text} of the section "Parameters" of a docstring in NumPy's style."""
    section = re.search(r"^Parameters\n-{10}\n(.*?)(?=\n\n|\Z)", text, re.M | re.S)
    items = re.findall(r"^(\S+?)((?: : .*)?(?:\n    .*)*)$", section[1] if section else "", re.M)
    return dict(items)


@pytest.mark.parametrize("path", sorted(signatures()))
def test_docstrings_have_all_parameters(path):
    told = {"**" * (one.kind == one.VAR_KEYWORD) + name: one
            for name, one in inspect.signature(found(path)).parameters.items() if name != "self"}
    written = entries(docstring(path))
    assert set(told) == set(written)
    for name, text in written.items():
        default = re.match(r" : .*, default (.*)", text)
        assert not default or ast.literal_eval(default[1]) == told[name].default, name


@pytest.mark.parametrize("path", sorted(signatures()))
def test_docstrings_have_what_is_returned(path):
    returned = ast.unparse(signatures()[path].returns)
    assert "\nReturns\n-------\n" in docstring(path) or returned == "None" or path.endswith("__len__")


@pytest.mark.parametrize("path", sorted(signatures()))
def test_signatures_are_those_of_the_stub(path):
    stub = signatures()[path].args
    told = inspect.signature(found(path)).parameters
    named = [argument.arg for argument in stub.args + stub.kwonlyargs]
    extra = set(told) - set(named) - {name for name in told if name.startswith("lambda_")}
    assert set(named) <= set(told) and (not extra or stub.kwarg or path == "offhand"), (path, extra)
    order = [name for name, one in told.items() if one.kind == one.POSITIONAL_OR_KEYWORD]
    assert order == [argument.arg for argument in stub.args], path


def arrays():
    """(item, argument) of everything in the stub that takes an array, by its dotted name."""
    for node in ast.parse((FOLDER / "_core.pyi").read_text()).body:
        for member in node.body if isinstance(node, ast.ClassDef) else [node]:
            if not isinstance(member, ast.FunctionDef) or ".setter" in ast.unparse(member):
                continue
            path = [node.name] + ([member.name] if member is not node else [])
            for argument in member.args.args + member.args.kwonlyargs:
                if argument.annotation and "ArrayLike" in ast.unparse(argument.annotation):
                    yield ".".join(path), argument.arg


@pytest.mark.parametrize("path, argument", sorted(arrays()))
def test_arrays_have_shapes(path, argument):
    """'points : array_like (N, 3)' and the like, in the docstring or one that it refers to."""
    text = entries(docstring(path))[argument]
    for name in re.findall(r"\b[Aa]s (?:in|of) (\w+)\(\)", text):
        text += entries(docstring(name)).get(argument, "")
    assert re.search(r"\((?:[A-Zn0-9]+,? ?)+\)", text), text


def keywords(name):
    """{name: default} of the keyword-only parameters in the stub."""
    arguments = signatures()[name].args
    return {argument.arg: default for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults)}


@pytest.mark.parametrize("job", ["convert", "export", "fit", "grasp", "import_motion", "reach", "refine",
                                 "render", "report", "score", "solve_keypoints", "solve_markers", "synthesize",
                                 "transfer", "transfer_to_robot"])
def test_stubs_have_the_options_of_the_table(job):
    table = holdfast.options(job)
    stub = keywords(job)
    if job == "grasp":
        stub |= keywords("grasps")
    lambdas = {name for name in table if name.startswith("lambda_")}
    assert set(table) - lambdas <= set(stub)
    for name in set(table) - lambdas:
        if not isinstance(stub[name], ast.Constant) or stub[name].value is ...:
            continue
        default = table[name]["default"] if name != "switch_frames" else None
        value = ast.literal_eval(stub[name])
        assert (list(value) if isinstance(value, tuple) else value) == default, name
        assert table[name]["help"] and table[name]["flag"].startswith("--")
    refused(ValueError, "expected one of", holdfast.options, "walk")


@pytest.mark.parametrize("words, call, arguments, options", [
    ("object_scale", holdfast.fit, ("demo_drink", "mug"), {"object_scal": 2.0}),
    ("object", holdfast.fit, ("demo_drink", "mug"), {"obj": "mug"}),
    ("threads", holdfast.fit, ("demo_drink", "mug"), {"thread": 1}),
    ("seed", holdfast.offhand, ("demo_drink", "mug"), {"sed": 1}),
    ("progress", holdfast.score, ("demo_drink",), {"progres": print}),
    ("vertices", holdfast.decimate, ("mug",), {"vertice": 5}),
    ("frame_rate", holdfast.Clip.load, ("demo_drink",), {"frame_rat": 30.0}),
    ("contact_threshold_mm", holdfast.FrameFitter, ("mug",), {"contact_threshold": 5.0}),
    ("side", holdfast.BodyModel.load().hand_vertex_ids, (), {"sides": "left"}),
])
def test_misspelled_arguments_are_told_with_what_is_near(words, call, arguments, options):
    refused(TypeError, f"'{next(iter(options))}'. Did you mean '{words}'", call, *arguments, **options)


def test_unknown_arguments_are_told():
    refused(TypeError, r"doctor\(\) got an unexpected keyword argument 'xyz'", holdfast.doctor, "mug", xyz=1)
    refused(TypeError, r"Clip\(\) got an unexpected keyword argument 'xyz'", holdfast.Clip, [], [], xyz=1)
    refused(TypeError, "incompatible function arguments", holdfast.decimate)


def test_docstrings_of_the_stub_need_no_numpy(tmp_path):
    """'pip install .' writes them where numpy is not yet installed: without site packages."""
    script = ROOT / "python/document_stubs.py"
    stub = script.parent / "holdfast/_core.pyi"
    out = tmp_path / "_core.pyi"
    subprocess.run([sys.executable, "-I", "-S", script, _core.__file__, stub, out], check=True)
    assert out.read_text().count("Parameters\n") > 50
