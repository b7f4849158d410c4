# SPDX-License-Identifier: MIT
import pickle
from collections import OrderedDict

import numpy as np
import pytest

import holdfast
from support import refused

CUBE = (
    np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) * 0.1,
    np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
              [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]),
)
BAD_MESHES = [
    (TypeError, 3, "expected a path"),
    (TypeError, None, "expected a path"),
    (TypeError, (1, 2, 3), "expected a path"),
    (ValueError, (np.zeros((4, 2)), CUBE[1]), "vertices: expected"),
    (ValueError, (CUBE[0], CUBE[1][:, :2]), "faces: expected"),
    (TypeError, (CUBE[0], CUBE[1] * 1.0), "faces: expected whole numbers"),
    (ValueError, (CUBE[0] * np.nan, CUBE[1]), "NaN"),
    (holdfast.Error, (CUBE[0] * 1e9, CUBE[1]), "coordinate"),
    (ValueError, (CUBE[0], CUBE[1] + 1), r"is vertex 8, of 8"),
    (ValueError, (CUBE[0], CUBE[1] - 1), r"is vertex -1, of 8"),
    (ValueError, (np.zeros((0, 3)), np.zeros((0, 3), int)), "got none"),
    (ValueError, (CUBE[0], np.zeros((0, 3), int)), "got none"),
]
BAD_SURFACES = BAD_MESHES + [
    (holdfast.Error, "no_such_thing", "neither a file nor an embedded object"),
    (holdfast.Error, (CUBE[0] * 0.0, CUBE[1]), "area"),
]


def shifted(by):
    return CUBE[0] + by, CUBE[1]


def test_embedded_objects():
    assert {"mug", "bottle", "apple"} <= set(holdfast.object_names())
    vertices, faces = holdfast.load_mesh("apple")
    assert vertices.dtype == np.float64 and vertices.shape[1] == 3
    assert faces.shape[1] == 3 and faces.max() == len(vertices) - 1
    large, same = holdfast.load_mesh("apple", scale=2)
    assert np.allclose(large, 2 * vertices) and np.array_equal(same, faces)
    for scale in (0, -1, np.nan, np.inf):
        refused(ValueError, "scale", holdfast.load_mesh, "apple", scale)


def test_files(tmp_path):
    path = tmp_path / "triangle.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    vertices, faces = holdfast.load_mesh(path, 0.1)
    assert np.allclose(vertices, [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]])
    assert faces.tolist() == [[0, 1, 2]]
    path.write_text("v 0 0 0\nf 1 2 3\n")
    for load in (holdfast.load_mesh, holdfast.check_mesh, holdfast.decimate):
        refused(holdfast.Error, "triangle.obj", load, str(path))


@pytest.mark.parametrize("error, mesh, message", BAD_SURFACES)
def test_bad_meshes(error, mesh, message):
    for take in (holdfast.decimate, holdfast.SignedDistance,
                 lambda mesh: holdfast.intersection_volume("apple", mesh),
                 lambda mesh: holdfast.intersection_volume(mesh, CUBE, exact=False)):
        refused(error, message, take, mesh)


@pytest.mark.parametrize("error, mesh, message", BAD_MESHES)
def test_bad_meshes_are_not_checked(error, mesh, message):
    refused(error, message, holdfast.check_mesh, mesh)
    refused(error, message, holdfast.doctor, mesh)


def test_decimate():
    vertices, faces = holdfast.decimate("apple", 120)
    assert vertices.shape == (120, 3) and faces.max() == 119
    again, _ = holdfast.decimate(holdfast.load_mesh("apple"), 120)
    assert np.array_equal(vertices, again)
    other, _ = holdfast.decimate("apple", vertices=120, method="garland-heckbert")
    assert other.shape == (120, 3)
    assert len(holdfast.decimate(CUBE)[0]) == 8
    refused(holdfast.Error, "4 or more", holdfast.decimate, "apple", 3)
    refused(holdfast.Error, "lindstrom-turk", holdfast.decimate, "apple", method="by hand")


def test_check_mesh():
    report = holdfast.check_mesh(CUBE)
    assert report["watertight"] and report["num_vertices"] == 8 and report["num_edges"] == 18
    assert report["volume_m3"] == pytest.approx(1e-3)
    assert report["area_m2"] == pytest.approx(0.06)
    assert report["extent_m"] == pytest.approx((0.1, 0.1, 0.1))
    open_cube = holdfast.check_mesh((CUBE[0], CUBE[1][:-1]))
    assert not open_cube["watertight"] and open_cube["num_boundary_edges"] == 3
    assert len(open_cube["description"]) > 1
    assert holdfast.check_mesh("mug")["num_faces"] > 100
    refused(holdfast.Error, "neither a file nor an embedded object", holdfast.check_mesh, "no_such_thing")


def test_doctor(tmp_path):
    sound = holdfast.doctor(CUBE)
    assert sound and {finding["verdict"] for finding in sound} == {"ok"}
    findings = holdfast.doctor((CUBE[0] * 1000, CUBE[1][:-1]))
    assert {finding["verdict"] for finding in findings} == {"warning"}
    assert any("--object-scale" in finding["fix"] for finding in findings)
    assert holdfast.doctor("mug")
    clip = holdfast.Clip.load("demo_drink")
    verdicts = [finding["verdict"] for finding in holdfast.doctor(clip)]
    assert verdicts and "fault" not in verdicts
    assert "fault" not in [finding["verdict"] for finding in holdfast.doctor("demo_drink")]
    clip.trans[3, 1] = np.nan
    faults = [f for f in holdfast.doctor(clip) if f["verdict"] == "fault"]
    assert any("NaN" in fault["text"] for fault in faults)
    (tmp_path / "empty.npz").write_bytes(b"")
    assert any(f["verdict"] == "fault" for f in holdfast.doctor(tmp_path / "empty.npz"))
    assert any(f["verdict"] == "fault" for f in holdfast.doctor(tmp_path / "missing.npz"))


def box_distance(points):
    """Signed distance to the cube [0, 0.1]^3."""
    beyond = np.abs(points - 0.05) - 0.05
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return outside + np.minimum(beyond.max(axis=1), 0)


def test_signed_distance():
    surface = holdfast.SignedDistance(CUBE)
    assert surface.watertight and surface.cell == 0
    points = np.random.default_rng(3).uniform(-0.1, 0.2, (3000, 3))
    distances = surface(points)
    assert distances.shape == (3000,)
    assert np.allclose(distances, box_distance(points), atol=1e-12)
    assert np.array_equal(distances, holdfast.SignedDistance(*CUBE)(points, threads=3))
    same, gradients = surface.gradient(points)
    assert np.allclose(same, distances, atol=1e-15) and gradients.shape == (3000, 3)
    assert np.allclose(np.linalg.norm(gradients, axis=1), 1)
    # Along the gradient is the closest point, where the distance is zero.
    assert np.allclose(surface(points - distances[:, None] * gradients), 0, atol=1e-12)
    assert surface(np.zeros((0, 3))).shape == (0,)
    assert surface.gradient(np.zeros((0, 3)))[1].shape == (0, 3)


def test_distance_grid():
    grid = holdfast.SignedDistance(CUBE, cell=0.004)
    assert grid.cell == pytest.approx(0.004)
    points = np.random.default_rng(4).uniform(-0.015, 0.115, (500, 3))
    distances, gradients = grid.gradient(points)
    assert np.allclose(distances, grid(points), atol=1e-12)
    assert np.allclose(distances, box_distance(points), atol=0.002)
    step = 1e-6
    for axis in range(3):
        moved = step * np.eye(3)[axis]
        slopes = (grid(points + moved) - grid(points - moved)) / (2 * step)
        assert np.allclose(gradients[:, axis], slopes, atol=5e-4)


def test_bad_queries():
    surface = holdfast.SignedDistance(CUBE)
    for query in (surface, surface.gradient):
        refused(ValueError, "points: expected", query, np.zeros((2, 2)))
        refused(ValueError, "points: expected", query, np.zeros(3))
        refused(ValueError, r"points\[0, 0\] is NaN", query, [[np.nan, 0, 0]])
        refused(holdfast.Error, "points", query, [[1e200, 0, 0]])
        refused(TypeError, "", query, "here")
        refused(ValueError, "threads", query, np.zeros((1, 3)), -1)
    for options in (dict(cell=-1), dict(cell=1e-320), dict(cell=np.nan), dict(cell=np.inf)):
        refused(ValueError, "cell", holdfast.SignedDistance, CUBE, **options)
    for padding in (0, -1, np.nan, np.inf):
        refused(ValueError, "padding", holdfast.SignedDistance, CUBE, cell=0.01, padding=padding)
    refused(ValueError, "faces", holdfast.SignedDistance, CUBE[0], CUBE[1] + 5)


def test_intersection_volume():
    moved = shifted([0.04, 0.03, -0.05])
    exact = holdfast.intersection_volume(CUBE, moved)
    assert exact == pytest.approx(0.06 * 0.07 * 0.05, rel=1e-9)
    counted = holdfast.intersection_volume(CUBE, moved, exact=False, voxel=0.002)
    assert counted == pytest.approx(exact, rel=0.1)
    assert holdfast.intersection_volume(CUBE, shifted(1.0)) == 0
    opened = (CUBE[0], CUBE[1][:-1])
    refused(holdfast.Error, "not closed", holdfast.intersection_volume, opened, moved)
    assert holdfast.intersection_volume(opened, moved, exact=False) > 0
    for voxel in (0, -1, np.nan, 1e-300):
        refused(ValueError, "voxel", holdfast.intersection_volume, CUBE, moved, exact=False, voxel=voxel)


def test_load_pickle_safe(tmp_path):
    shared = np.arange(6, dtype=np.int16).reshape(2, 3)
    data = {
        "half": np.linspace(0, 1, 5, dtype=np.float16),
        "fortran": np.asfortranarray(np.arange(12.0).reshape(3, 4)),
        "big": np.arange(3, dtype=">i4"),
        "flags": np.array([True, False]),
        "bytes": np.arange(3, dtype=np.uint8),
        "scalar": np.array(2.5),
        "empty": np.zeros((0, 3), np.float32),
        "names": np.array(["a", "bcd"]),
        "nested": OrderedDict(a=[1, 2.5, None, True, "text", (shared, shared)], b={"raw": b"\xff"}),
        7: "seven",
    }
    path = tmp_path / "data.pkl"
    path.write_bytes(pickle.dumps(data))
    read = holdfast.load_pickle_safe(path)
    for name in ("half", "fortran", "big", "flags", "bytes", "scalar", "empty", "names"):
        assert read[name].dtype == data[name].dtype and read[name].shape == data[name].shape, name
        assert np.array_equal(read[name], data[name]), name
    nested = read["nested"]["a"]
    assert nested[:5] == [1, 2.5, None, True, "text"] and nested[3] is True
    assert np.array_equal(nested[5][0], shared) and nested[5][0] is nested[5][1]
    assert read["nested"]["b"]["raw"] == b"\xff" and read["7"] == "seven"
    read["half"][0] = 3  # an array of its own

    np.savez(tmp_path / "data.npz", trans=np.ones((2, 3), np.float32), name="text")
    assert holdfast.load_pickle_safe(str(tmp_path / "data.npz"))["trans"].dtype == np.float32
    (tmp_path / "data.json").write_text('{"a": [1, 2], "b": {"c": 0.5}}')
    assert holdfast.load_pickle_safe(tmp_path / "data.json") == {"a": [1, 2], "b": {"c": 0.5}}


def test_lists_that_hold_themselves_and_each_other(tmp_path):
    loop = []
    loop.append(loop)
    doubled = [1]
    for _ in range(60):  # 2^60 values, were they counted one by one
        doubled = [doubled, doubled]
    deep = []
    for _ in range(300):
        deep = [deep]
    path = tmp_path / "lists.pkl"
    path.write_bytes(pickle.dumps({"loop": loop, "doubled": doubled}))
    read = holdfast.load_pickle_safe(path)
    assert read["loop"][0] is read["loop"]
    assert read["doubled"][0] is read["doubled"][1]
    path.write_bytes(pickle.dumps({"deep": deep}))
    refused(holdfast.Error, "nested", holdfast.load_pickle_safe, path)


class Harm:
    def __reduce__(self):
        return print, ("executed",)


def test_nothing_is_executed(tmp_path, capsys):
    path = tmp_path / "harm.pkl"
    path.write_bytes(pickle.dumps({"a": 1, "b": Harm()}))
    refused(holdfast.Error, "print", holdfast.load_pickle_safe, path)
    assert "executed" not in capsys.readouterr().out
    path.write_bytes(pickle.dumps({"a": np.arange(100)})[:-20])
    refused(holdfast.Error, "harm.pkl", holdfast.load_pickle_safe, path)
    refused(holdfast.Error, "missing.pkl", holdfast.load_pickle_safe, tmp_path / "missing.pkl")
    refused(TypeError, "", holdfast.load_pickle_safe, 3)
