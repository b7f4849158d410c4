# SPDX-License-Identifier: MIT
"""tests/evaluation/average_networks.py: the average of two networks, and what cannot be averaged."""
import json
import pathlib
import struct
import subprocess
import sys

import numpy
import pytest

SCRIPT = pathlib.Path(__file__).parents[1] / "evaluation" / "average_networks.py"
NAMES = {"float16": "F16", "float32": "F32", "float64": "F64"}


def write(path, **tensors):
    header, data = {"__metadata__": {"iteration": "7", "width": "4"}}, b""
    for name, values in tensors.items():
        header[name] = {
            "dtype": NAMES[str(values.dtype)],
            "shape": list(values.shape),
            "data_offsets": [len(data), len(data) + values.nbytes],
        }
        data += values.tobytes()
    text = json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + data)
    return path


def average(*arguments):
    return subprocess.run([sys.executable, SCRIPT, *map(str, arguments)], capture_output=True, text=True)


@pytest.fixture
def output(tmp_path):
    return tmp_path / "out.safetensors"


@pytest.fixture
def first(tmp_path):
    return write(tmp_path / "a", w=numpy.float16([[1, 2], [3, -4]]), statistics=numpy.float32([5, 6]))


def test_weighs_both(tmp_path, first, output):
    second = write(tmp_path / "b", w=numpy.float16([[5, 2], [-1, 0]]), statistics=numpy.float32([5, 6]))
    assert average(first, second, 0.25, output).returncode == 0
    data = output.read_bytes()
    (size,) = struct.unpack("<Q", data[:8])
    header = json.loads(data[8 : 8 + size])
    begin, end = header["w"]["data_offsets"]
    w = numpy.frombuffer(data[8 + size :][begin:end], numpy.float16)
    assert w.tolist() == [2, 2, 2, -3]
    assert header["__metadata__"]["width"] == "4"
    assert "iteration" not in header["__metadata__"]
    assert list(tmp_path.glob("*.part")) == []


@pytest.mark.parametrize(
    "tensors, said",
    [
        ({"w": numpy.float16([1, 2, 3, 4]), "statistics": numpy.float32([5, 6])}, "w is not what"),
        ({"w": numpy.float16([[1, 2], [3, 4]])}, "statistics is not what"),
        ({"w": numpy.float16([[1, 2], [3, 4]]), "statistics": numpy.float32([5, 7])}, "statistics differs"),
        ({"w": numpy.float64([[1, 2], [3, 4]]), "statistics": numpy.float32([5, 6])}, "w is F64"),
    ],
)
def test_refuses_another_network(tmp_path, first, output, tensors, said):
    run = average(first, write(tmp_path / "b", **tensors), 0.5, output)
    assert run.returncode == 1
    assert said in run.stderr and "Traceback" not in run.stderr
    assert not output.exists()


def test_refuses_what_is_no_network(tmp_path, first, output):
    (tmp_path / "text").write_text("weights")
    for second, share, said in (("text", 0.5, "no safetensors"), ("none", 0.5, "no safetensors"), ("a", "half", "share half")):
        run = average(first, tmp_path / second, share, output)
        assert run.returncode == 1
        assert said in run.stderr and "Traceback" not in run.stderr
        assert not output.exists()
