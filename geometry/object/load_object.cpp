// SPDX-License-Identifier: MIT
#include "geometry/object/load_object.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/embedded.h"
#include "geometry/io/mesh/collada.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/robot/reader_process.h"
#include "geometry/suggestion.h"

namespace holdfast {

namespace fs = std::filesystem;

std::vector<std::string> EmbeddedObjectNames() {
  std::vector<std::string> names = EmbeddedNames("objects", ".ply");
  std::erase_if(names, [](const std::string& name) { return name.ends_with("_300"); });
  return names;
}

namespace {

MeshFile ReadEmbedded(const std::string& path) {
  const EmbeddedFile file = FindEmbedded(path);
  return ReadMeshBytes({reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()},
                       file.name);
}

// Files of libraries that need a process of their own.
MeshFile ReadLinked(const fs::path& path) {
  if (IsCollada(path)) {
    const RobotHand one = ReadInProcess(path, "assimp", [&] {
      RobotHand scene;
      scene.links.emplace_back().shapes.push_back(ReadCollada(path));
      return scene;
    });
    return {one.links[0].shapes[0], {}};
  }
  RobotHand object = ReadLinks(path);
  MeshFile file{MeshOfLinks(object), std::move(object.notes)};
  if (!object.dofs.empty()) {
    file.notes.push_back(fmt::format("{} joint{} of {} stay{} at 0, or at the nearest bound",
                                     object.NumDofs(), object.NumDofs() == 1 ? "" : "s",
                                     path.filename().string(), object.NumDofs() == 1 ? "s" : ""));
  }
  return file;
}

// The version with 300 vertices of an embedded object, if `object` is one, at any scale.
std::optional<TriangleMesh> SimplifiedEmbedded(const LoadedObject& object) {
  const std::string whole = fmt::format("objects/{}.ply", object.name);
  const std::string few = fmt::format("objects/{}_300.ply", object.name);
  if (!HasEmbedded(whole) || !HasEmbedded(few)) return std::nullopt;
  const Eigen::Matrix3Xd given = ReadEmbedded(whole).mesh.vertices;
  const Eigen::Matrix3Xd& vertices = object.mesh.vertices;
  if (given.cols() != vertices.cols()) return std::nullopt;
  const double scale = vertices.norm() / given.norm();
  if (!(vertices - scale * given).isZero(1e-12 * scale)) return std::nullopt;
  TriangleMesh simplified = ReadEmbedded(few).mesh;
  simplified.vertices *= std::abs(scale - 1.0) < 1e-12 ? 1.0 : scale;
  return simplified;
}

}  // namespace

LoadedObject LoadObject(const std::string& path_or_name, double scale) {
  const std::vector<std::string> names = EmbeddedObjectNames();
  const bool embedded = std::ranges::find(names, path_or_name) != names.end();
  MeshFile file;
  std::string name = path_or_name;
  // A folder named like an embedded object does not hide it.
  std::error_code ignored;
  if (fs::exists(path_or_name, ignored) && !(fs::is_directory(path_or_name, ignored) && embedded)) {
    name = fs::path(path_or_name).stem().string();
    file = HasRobotFormat(path_or_name) || IsCollada(path_or_name) ? ReadLinked(path_or_name)
                                                                   : ReadMeshFile(path_or_name);
  } else {
    if (!embedded) {
      throw Error(
          path_or_name, "is neither a file nor an embedded object",
          Suggestion(path_or_name, names) +
              fmt::format("Give a mesh (.obj .ply .stl .off .glb .gltf .dae .urdf), or one of: {}",
                          fmt::join(names, ", ")));
    }
    file = ReadEmbedded(fmt::format("objects/{}.ply", path_or_name));
  }
  LoadedObject object = ObjectOfMesh(file.mesh, std::move(name), path_or_name, scale);
  object.notes.insert(object.notes.begin(), std::make_move_iterator(file.notes.begin()),
                      std::make_move_iterator(file.notes.end()));
  return object;
}

LoadedObject ObjectOfMesh(const TriangleMesh& mesh, std::string name, std::string source,
                          double scale) {
  LoadedObject object;
  object.name = std::move(name);
  object.source = std::move(source);
  RepairedMesh repaired = NamingSource("mesh", object.source, [&] { return RepairMesh(mesh); });
  object.mesh = std::move(repaired.mesh);
  object.mesh.vertices *= scale;
  RequireInRange(object.mesh, object.source);
  object.notes = std::move(repaired.actions);
  const MeshReport report =
      NamingSource("mesh", object.source, [&] { return CheckMesh(object.mesh); });
  object.implausible_size = report.implausible_size;
  if (report.implausible_size) {
    object.notes.push_back(fmt::format(
        "The object is {:.3g} x {:.3g} x {:.3g} m. {}", report.extent_m.x(), report.extent_m.y(),
        report.extent_m.z(), UnitRemedy(report.extent_m, object.source)));
  }
  if (!report.watertight) {
    object.notes.push_back("The mesh is not watertight: inside is decided by winding number");
  }
  return object;
}

void RequireHandheld(const LoadedObject& object) {
  if (!object.implausible_size) return;
  const Eigen::Vector3d extent = Extent(object.mesh);
  throw Error(object.source,
              fmt::format("is {:.3g} x {:.3g} x {:.3g} m, not a graspable size", extent.x(),
                          extent.y(), extent.z()),
              UnitRemedy(extent, object.source));
}

TriangleMesh ForFitting(const LoadedObject& object, int vertices, std::vector<std::string>* notes) {
  if (object.mesh.NumVertices() <= vertices) {
    TriangleMesh mesh = object.mesh;
    const EdgeCounts edges = CountEdges(mesh.faces, EdgeTable(mesh.faces, mesh.NumVertices()));
    if (edges.boundary == 0 || edges.non_manifold + edges.misoriented == 0) return mesh;
    const std::vector<std::string> parted = PartSheets(mesh);
    if (notes != nullptr) notes->insert(notes->end(), parted.begin(), parted.end());
    return mesh;
  }
  if (std::optional<TriangleMesh> own = SimplifiedEmbedded(object);
      own && own->NumVertices() == vertices) {
    return *std::move(own);
  }
  DecimateOptions options;
  options.vertices = vertices;
  options.samples = 0;
  DecimateResult result =
      NamingSource("mesh", object.source, [&] { return Decimate(object.mesh, options); });
  if (notes != nullptr) {
    for (std::string& note : result.notes) notes->push_back(std::move(note));
  }
  return std::move(result.mesh);
}

}  // namespace holdfast
