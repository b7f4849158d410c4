// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <optional>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/inspect/inspection.h"
#include "geometry/io/container/temporary_folder.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/options.h"
#include "geometry/parallel.h"
#include "geometry/score/contact_metrics.h"
#include "geometry/score/exact_intersection.h"
#include "python/src/bindings.h"
#include "python/src/numpy.h"
#include "python/src/run.h"

namespace holdfast::python {
namespace {

using namespace py::literals;
namespace fs = std::filesystem;

constexpr double kMinCell = 1e-5;  // meters; smaller cells give too many grid cells and voxels

TriangleMesh MeshOfArrays(const py::handle& vertices, const py::handle& faces,
                          const std::string& name) {
  TriangleMesh mesh;
  mesh.vertices = Columns(vertices, (name + " vertices").c_str());
  const py::array_t<int> ids = Integers(faces, (name + " faces").c_str(), {-1, 3});
  if (mesh.NumVertices() == 0 || ids.size() == 0) {
    throw py::value_error(name + ": expected one vertex and one face or more, got none");
  }
  for (py::ssize_t i = 0; i < ids.size(); ++i) {
    const int id = ids.data()[i];
    if (id >= 0 && id < mesh.NumVertices()) continue;
    throw py::value_error(fmt::format("{} faces[{}, {}] is vertex {}, of {} vertices from 0 on",
                                      name, i / 3, i % 3, id, mesh.NumVertices()));
  }
  mesh.faces = Eigen::Map<const Eigen::Matrix3Xi>(ids.data(), 3, ids.shape(0));
  RequireInRange(mesh, name);
  return mesh;
}

// Converts (vertices, faces), or an object with both attributes.
TriangleMesh MeshOfPair(const py::handle& value, const std::string& name) {
  if (py::hasattr(value, "vertices") && py::hasattr(value, "faces")) {
    return MeshOfArrays(value.attr("vertices"), value.attr("faces"), name);
  }
  if ((py::isinstance<py::tuple>(value) || py::isinstance<py::list>(value)) &&
      py::len(value) == 2) {
    const auto pair = py::reinterpret_borrow<py::sequence>(value);
    return MeshOfArrays(pair[0], pair[1], name);
  }
  throw py::type_error(
      fmt::format("{}: expected a path, the name of an embedded object or (vertices (V, 3), faces "
                  "(F, 3)), got {}",
                  name, TypeText(value)));
}

py::tuple DecimateMesh(const py::object& mesh, int vertices, const std::string& method,
                       bool allow_wrap) {
  DecimateOptions options;
  options.vertices = vertices;
  options.method = ParseDecimateMethod(method);
  options.allow_wrap = allow_wrap;
  options.samples = 0;
  const LoadedObject object = ObjectOf(mesh, 1.0, "mesh");
  const DecimateResult result = RunAside([object, options] {
    return NamingSource("mesh", object.source, [&] { return Decimate(object.mesh, options); });
  });
  LogNotes(result.notes);
  return MeshTuple(result.mesh);
}

py::dict Check(const py::object& value) {
  const MeshReport report =
      RunAside([mesh = MeshArgument(value, "mesh")] { return CheckMesh(mesh); });
  const Eigen::Vector3d& e = report.extent_m;
  return py::dict("watertight"_a = report.watertight, "num_vertices"_a = report.num_vertices,
                  "num_faces"_a = report.num_faces, "num_edges"_a = report.num_edges,
                  "num_components"_a = report.num_components,
                  "num_boundary_edges"_a = report.num_boundary_edges,
                  "num_non_manifold_edges"_a = report.num_non_manifold_edges,
                  "num_non_manifold_vertices"_a = report.num_non_manifold_vertices,
                  "num_duplicate_vertices"_a = report.num_duplicate_vertices,
                  "num_unreferenced_vertices"_a = report.num_unreferenced_vertices,
                  "num_degenerate_faces"_a = report.num_degenerate_faces,
                  "num_duplicate_faces"_a = report.num_duplicate_faces,
                  "num_misoriented_edges"_a = report.num_misoriented_edges,
                  "num_inside_out_components"_a = report.num_inside_out_components,
                  "num_nested_solids"_a = report.num_nested_solids,
                  "extent_m"_a = py::make_tuple(e.x(), e.y(), e.z()), "area_m2"_a = report.area_m2,
                  "volume_m3"_a = report.volume_m3, "implausible_size"_a = report.implausible_size,
                  "suggested_scale"_a = report.suggested_scale, "description"_a = Describe(report));
}

// Writes embedded data to a file in `folder`; returns `path` if nothing is embedded by that name.
fs::path WriteEmbedded(const fs::path& path, const fs::path& folder) {
  for (const auto& [kind, extension] : {std::pair("clips", ".npz"), {"objects", ".ply"}}) {
    const std::string name = path.string() + extension;
    if (!HasEmbedded(fmt::format("{}/{}", kind, name))) continue;
    const EmbeddedFile file = FindEmbedded(fmt::format("{}/{}", kind, name));
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(file.bytes.data()),
               static_cast<std::streamsize>(file.bytes.size()));
    return folder / name;
  }
  return path;
}

py::list Doctor(const py::object& value) {
  const auto folder = std::make_shared<const TemporaryFolder>();
  fs::path path;
  if (py::isinstance<Clip>(value)) {
    path = folder->path / "clip.npz";
    Clip clip = value.cast<const Clip&>();
    if (clip.object) clip.object->mesh.clear();  // relative to another folder
    WriteClip(clip, path);
  } else if (IsPath(value)) {
    path = std::string(py::str(value));
    std::error_code ignored;
    if (!fs::exists(path, ignored)) path = WriteEmbedded(path, folder->path);
  } else {
    path = folder->path / "mesh.ply";
    WriteMesh(MeshOfPair(value, "clip_or_mesh"), path);
  }
  const Inspection inspection = RunAside([folder, path] { return Inspect(path); });

  const std::string prefix = folder->path.string() + "/";
  const auto text = [&](std::string line) {
    for (auto at = line.find(prefix); at != std::string::npos; at = line.find(prefix)) {
      line.erase(at, prefix.size());
    }
    // Texts in the file may not be UTF-8.
    return py::reinterpret_steal<py::str>(
        PyUnicode_DecodeUTF8(line.data(), static_cast<py::ssize_t>(line.size()), "replace"));
  };
  py::list findings;
  for (const Finding& finding : inspection.findings) {
    const char* verdict = finding.verdict == Verdict::kOk        ? "ok"
                          : finding.verdict == Verdict::kWarning ? "warning"
                                                                 : "fault";
    findings.append(py::dict("verdict"_a = verdict, "text"_a = text(finding.text),
                             "fix"_a = text(finding.fix)));
  }
  return findings;
}

double Volume(const py::object& mesh_a, const py::object& mesh_b, bool exact, double voxel,
              int threads) {
  if (!(voxel >= kMinCell)) throw py::value_error("voxel: expected 1e-5 m or more");
  const int used = ThreadsOf(threads);
  const LoadedObject object_a = ObjectOf(mesh_a, 1.0, "mesh_a");
  const LoadedObject object_b = ObjectOf(mesh_b, 1.0, "mesh_b");
  return RunAside([a = object_a, b = object_b, exact, voxel, used] {
    if (!exact) {
      return IntersectionVolume(SignedDistance(a.mesh), SignedDistance(b.mesh), voxel, used);
    }
    const ExactVolume found = ExactIntersectionVolume(a.mesh, b.mesh);
    if (!found.Known()) {
      throw Error(fmt::format("{} and {}", a.source, b.source),
                  fmt::format("have no exact intersection volume: {}", Describe(found.status)),
                  "Close and repair the surfaces (check_mesh reports where), or give exact=False");
    }
    return found.volume_m3;
  });
}

// Signed distance, exact or sampled on a grid.
class MeshDistance {
 public:
  MeshDistance(const TriangleMesh& mesh, double cell, double padding, int threads) : exact_(mesh) {
    if (cell == 0.0) return;
    DistanceGridOptions options;
    options.cell_m = cell;
    options.padding_m = padding;
    options.threads = threads;
    grid_.emplace(exact_, options);
  }

  bool Watertight() const { return exact_.IsWatertight(); }
  double Cell() const { return grid_ ? grid_->CellSize() : 0.0; }

  /// Computes distances (N), and gradients (3 x N) if requested.
  void Query(const Eigen::Matrix3Xd& points, int threads, Eigen::Map<Eigen::VectorXd> distances,
             Eigen::Map<Eigen::Matrix3Xd>* gradients) const {
    constexpr Eigen::Index kBlock = 1024;
    RunWithProgress(py::none(), [&](const StagedProgress& progress) {
      const auto blocks = static_cast<int>((points.cols() + kBlock - 1) / kBlock);
      ParallelFor(blocks, threads, [&](int block) {
        if (!progress("points", 0, 0)) return;
        const Eigen::Index begin = block * kBlock;
        const Eigen::Index count = std::min(kBlock, points.cols() - begin);
        if (!grid_ && gradients == nullptr) {
          distances.segment(begin, count) = exact_.Distances(points.middleCols(begin, count));
          return;
        }
        for (Eigen::Index i = begin; i < begin + count; ++i) {
          Eigen::Vector3d gradient;
          if (grid_) {
            distances[i] = grid_->Distance(points.col(i), gradients ? &gradient : nullptr);
          } else {
            const SignedDistance::Result result = exact_.Query(points.col(i));
            distances[i] = result.distance;
            gradient = result.gradient;
          }
          if (gradients != nullptr) gradients->col(i) = gradient;
        }
      });
    });
  }

 private:
  SignedDistance exact_;
  std::optional<DistanceGrid> grid_;
};

std::unique_ptr<MeshDistance> MakeDistance(const py::object& mesh, const py::object& faces,
                                           double cell, double padding, int threads) {
  if (cell != 0.0 && !(cell >= kMinCell && cell <= kMaxMeters)) {
    throw py::value_error("cell: expected 0 (exact), or a grid's cells of 1e-5 m or more");
  }
  if (!(padding > 0.0 && padding <= kMaxMeters)) {
    throw py::value_error("padding: expected more than 0 m");
  }
  const int used = ThreadsOf(threads);
  const LoadedObject object =
      ObjectOf(faces.is_none() ? mesh : py::make_tuple(mesh, faces), 1.0, "mesh");
  return RunAside([object, cell, padding, used] {
    return NamingSource("mesh", object.source, [&] {
      return std::make_unique<MeshDistance>(object.mesh, cell, padding, used);
    });
  });
}

py::object QueryPoints(const MeshDistance& surface, const py::object& points, int threads,
                       bool with_gradients) {
  const Eigen::Matrix3Xd at = Columns(points, "points");
  RequireWithin(at, kMaxMeters, "SignedDistance", "points", "row", kMetersRemedy);
  const int used = ThreadsOf(threads);
  py::array_t<double> distances(static_cast<py::ssize_t>(at.cols()));
  py::array_t<double> gradients({py::ssize_t{with_gradients ? at.cols() : 0}, py::ssize_t{3}});
  Eigen::Map<Eigen::Matrix3Xd> gradient_rows(gradients.mutable_data(), 3, gradients.shape(0));
  surface.Query(at, used, {distances.mutable_data(), at.cols()},
                with_gradients ? &gradient_rows : nullptr);
  if (!with_gradients) return distances;
  return py::make_tuple(distances, gradients);
}

void BindDistance(py::module_& module) {
  py::class_<MeshDistance>(module, "SignedDistance",
                           R"(Signed distance to a surface, meters: negative inside.

With cell=0, distances are exact: closest points from a tree of boxes. The sign of a watertight mesh
is from the angle-weighted pseudonormal, that of any other from the generalized winding number, at
O(faces) per point. With a cell size, a grid is used: tricubic interpolation of exact distances at
its nodes, about 100 ns per point, within the padding of the surface's box; beyond it a lower bound.

Parameters
----------
mesh : str, path, (vertices, faces) or array_like (V, 3)
    Mesh file, name of an embedded object, vertices (V, 3) and faces (F, 3), or the vertices alone.
    Repaired where that does not change the shape.
faces : array_like (F, 3) of int, optional
    Faces, if mesh is vertices.
cell : float, default 0.0
    Cell size of the grid, meters, such as 0.002; 0: exact.
padding : float, default 0.02
    Meters.
threads : int, default 0
    Threads that compute the grid; 0: all.

Raises
------
Error
    For surfaces without area.

Examples
--------
>>> holdfast.SignedDistance('mug')([[0, 0, 0.1]])
>>> holdfast.SignedDistance(vertices, faces)
)")
      .def(py::init(&MakeDistance), "mesh"_a, "faces"_a = py::none(), py::kw_only(), "cell"_a = 0.0,
           "padding"_a = 0.02, "threads"_a = 0)
      .def_property_readonly("watertight", &MeshDistance::Watertight,
                             "whether the mesh is watertight")
      .def("__repr__",
           [](const MeshDistance& self) {
             return self.Cell() > 0.0
                        ? fmt::format("<holdfast.SignedDistance: cells of {:g} m>", self.Cell())
                        : std::string("<holdfast.SignedDistance: exact>");
           })
      .def_property_readonly("cell", &MeshDistance::Cell,
                             "meters, 0 where distances are exact; a grid that would have more "
                             "than 20 million nodes has larger cells than asked for")
      .def(
          "__call__",
          [](const MeshDistance& self, const py::object& points, int threads) {
            return QueryPoints(self, points, threads, false);
          },
          "points"_a, "threads"_a = 0, R"(Returns the distances of points.

Parameters
----------
points : array_like (N, 3)
    Meters.
threads : int, default 0
    0: all.

Returns
-------
array (N,)
)")
      .def(
          "gradient",
          [](const MeshDistance& self, const py::object& points, int threads) {
            return QueryPoints(self, points, threads, true);
          },
          "points"_a, "threads"_a = 0,
          R"(Returns the distances of points, and their gradients.

Exact: gradients of unit length, away from the closest point outside; on the surface its normal. On
a grid: the exact derivative of the interpolated value, only approximately of unit length.

Parameters
----------
points : array_like (N, 3)
    Meters.
threads : int, default 0
    0: all.

Returns
-------
distances : array (N,)
gradients : array (N, 3)
)");
}

}  // namespace

TriangleMesh MeshArgument(const py::handle& value, const char* name, double scale) {
  std::string source = name;
  TriangleMesh mesh;
  if (IsPath(value)) {
    source = py::str(value);
    std::error_code ignored;
    if (!fs::is_regular_file(source, ignored)) return ObjectOf(value, scale, name).mesh;
    mesh = RunAside([source] { return ReadMesh(source); });
  } else {
    mesh = MeshOfPair(value, name);
  }
  mesh.vertices *= scale;
  RequireInRange(mesh, source);
  return mesh;
}

py::tuple MeshTuple(const TriangleMesh& mesh) {
  return py::make_tuple(Rows(mesh.vertices), Rows(mesh.faces));
}

LoadedObject ObjectOf(const py::handle& value, double scale, const char* name) {
  if (!(scale > 0.0) || !std::isfinite(scale)) {
    throw py::value_error(fmt::format("scale of {}: expected more than 0", name));
  }
  LoadedObject object;
  if (IsPath(value)) {
    object =
        RunAside([path = std::string(py::str(value)), scale] { return LoadObject(path, scale); });
  } else {
    object = RunAside([mesh = MeshOfPair(value, name), named = std::string(name), scale] {
      return ObjectOfMesh(mesh, named, named, scale);
    });
  }
  LogNotes(object.notes);
  return object;
}

void BindMesh(py::module_& module) {
  BindDistance(module);
  module.def("object_names", &EmbeddedObjectNames, R"(Returns the names of the embedded objects.

Returns
-------
list of str
)");
  module.def(
      "load_mesh",
      [](const py::object& path_or_name, double scale) {
        return MeshTuple(ObjectOf(path_or_name, scale, "path_or_name").mesh);
      },
      "path_or_name"_a, "scale"_a = 1.0,
      R"(Reads a mesh (.obj .ply .stl .off .glb .gltf .dae .urdf) or an embedded object.

Repaired where that does not change the shape: coincident vertices are welded, faces without area
removed, parts oriented outwards. Repairs are logged to 'holdfast' (INFO).

Parameters
----------
path_or_name : str, path or (vertices, faces)
scale : float, default 1.0
    Multiplies the coordinates.

Returns
-------
vertices : array (V, 3)
    Meters.
faces : array (F, 3) of int

Raises
------
Error
    If the mesh cannot be read. The message names the file and the problem.
)");
  module.def("decimate", &DecimateMesh, "mesh"_a, "vertices"_a = 300, py::kw_only(),
             "method"_a = "lindstrom-turk", "allow_wrap"_a = true,
             R"(Collapses edges until a number of vertices are left.

Parameters
----------
mesh : str, path or (vertices, faces)
    Mesh file, name of an embedded object, or vertices (V, 3) in meters and faces (F, 3).
vertices : int, default 300
    Number of vertices to keep.
method : str, default 'lindstrom-turk'
    'lindstrom-turk', 'garland-heckbert' or 'garland-heckbert-probabilistic'.
allow_wrap : bool, default True
    Wrap a mesh first if it cannot be decimated directly.

Returns
-------
vertices : array (V, 3)
    Meters.
faces : array (F, 3) of int

Raises
------
Error
    If decimation fails.
)");
  module.def("check_mesh", &Check, "mesh"_a,
             R"(Checks a mesh without repairing it.

Parameters
----------
mesh : str, path or (vertices, faces)
    Mesh file, name of an embedded object, or vertices (V, 3) in meters and faces (F, 3).

Returns
-------
dict
    Defect counts, 'watertight', 'extent_m', 'area_m2', 'volume_m3', 'suggested_scale', and the same
    as sentences under 'description'.
)");
  module.def("doctor", &Doctor, "clip_or_mesh"_a,
             R"(Checks a clip, a mesh, or any file or result folder.

Does not raise for the content of a file.

Parameters
----------
clip_or_mesh : Clip, str, path or (vertices, faces)
    Clip, mesh, file, result folder, or name of an embedded clip or object.

Returns
-------
list of dict
    'verdict' ('ok', 'warning' or 'fault'), 'text' and 'fix' ('' if nothing is to be done).
)");
  module.def("intersection_volume", &Volume, "mesh_a"_a, "mesh_b"_a, "exact"_a = true,
             py::kw_only(), "voxel"_a = 0.002, "threads"_a = 0,
             R"(Computes the intersection volume of two solids.

Parameters
----------
mesh_a : str, path or (vertices, faces)
mesh_b : str, path or (vertices, faces)
    Mesh files, names of embedded objects, or vertices (V, 3) in meters and faces (F, 3).
exact : bool, default True
    Volume of the polyhedra, up to rounding. False: counted in cubes, for any surface.
voxel : float, default 0.002
    Edge of the cubes, meters.
threads : int, default 0
    0: all.

Returns
-------
float
    Cubic meters.

Raises
------
Error
    With exact, for surfaces that are open, or that intersect themselves where it matters.
)");
}

}  // namespace holdfast::python
