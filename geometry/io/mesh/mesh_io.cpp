// SPDX-License-Identifier: MIT
#include "geometry/io/mesh/mesh_io.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>
#include <sstream>

#include <fmt/format.h>
#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/exporter/ExporterT.hh>
#include <OpenMesh/Core/Mesh/DefaultTriMesh.hh>
#include <OpenMesh/Core/System/omstream.hh>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/gltf_mesh.h"
#include "geometry/io/mesh/mesh_scan.h"
#include "geometry/mesh/mesh_parts.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
namespace om = OpenMesh;

/// Exposes a TriangleMesh to OpenMesh's writers, manifold or not; OpenMesh's own mesh, which would
/// reject faces, stays empty. The mesh must outlive it.
class SoupExporter final : public om::IO::ExporterT<om::TriMesh> {
 public:
  explicit SoupExporter(const TriangleMesh& mesh) : ExporterT(nothing_), mesh_(mesh) {}

  om::Vec3d pointd(om::VertexHandle v) const override {
    const auto p = mesh_.vertices.col(v.idx());
    return {p.x(), p.y(), p.z()};
  }
  om::Vec3f point(om::VertexHandle v) const override { return om::Vec3f(pointd(v)); }
  unsigned int get_vhandles(om::FaceHandle f,
                            std::vector<om::VertexHandle>& corners) const override {
    corners.clear();
    for (int k = 0; k < 3; ++k) corners.emplace_back(mesh_.faces(k, f.idx()));
    return 3;
  }
  std::size_t n_vertices() const override { return mesh_.NumVertices(); }
  std::size_t n_faces() const override { return mesh_.NumFaces(); }

 private:
  const TriangleMesh& mesh_;
  om::TriMesh nothing_;
};

/// Returns ".obj" for a path that ends in ".OBJ".
std::string ExtensionOf(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

bool IsGltf(std::string_view extension) { return extension == ".glb" || extension == ".gltf"; }

/// Returns "obj" for ".OBJ". Throws Error unless the format can be read or, if asked, written.
std::string FormatOf(const fs::path& path, bool to_write) {
  const std::string extension = ExtensionOf(path);
  if (!HasMeshFormat(path) || (to_write && IsGltf(extension))) {
    throw Error(
        path.string(),
        extension.empty() ? "has no extension that shows its format"
        : to_write        ? fmt::format("'{}' is not a supported mesh output format", extension)
                          : fmt::format("'{}' is not a supported mesh format", extension),
        to_write ? "Use .obj, .ply, .stl or .off" : "Use .obj, .ply, .stl, .off, .glb or .gltf");
  }
  return extension.substr(1);
}

/// Splits a polygon into triangles: a fan around its first corner, or repeated halves for many
/// corners, so that no vertex gets more than about twenty triangles.
template <typename Add>
void SplitPolygon(std::span<const int> ids, const Add& add) {
  constexpr std::size_t kLargestFan = 64;
  if (ids.size() <= kLargestFan) {
    for (std::size_t i = 1; i + 1 < ids.size(); ++i) add(ids[0], ids[i], ids[i + 1]);
    return;
  }
  std::vector<std::pair<std::size_t, std::size_t>> open = {{0, ids.size() - 1}};
  while (!open.empty()) {
    const auto [low, high] = open.back();
    open.pop_back();
    if (high - low < 2) continue;
    const std::size_t middle = low + (high - low) / 2;
    add(ids[low], ids[middle], ids[high]);
    open.emplace_back(low, middle);
    open.emplace_back(middle, high);
  }
}

MeshScan Scan(const std::string& format, std::string_view bytes, const std::string& name) {
  if (format == "obj") return ScanObj(bytes, name);
  if (format == "ply") return ScanPly(bytes, name);
  if (format == "stl") return ScanStl(bytes, name);
  return ScanOff(bytes, name);
}

}  // namespace

MeshFile ReadMeshFile(const fs::path& path) {
  FormatOf(path, false);  // reject an unknown format before reading a large file
  // Every corner takes at least one byte, so that ids of corners fit an int.
  return ReadMeshBytes(ReadFile(path, std::numeric_limits<int>::max()), path);
}

MeshFile ReadMeshBytes(std::string_view bytes, const fs::path& path) {
  const std::string name = path.string();
  const std::string format = FormatOf(path, false);
  if (bytes.empty()) throw Error(name, "is empty", "Copy or export it again");
  if (IsGltf("." + format)) {
    MeshFile file;
    file.mesh =
        ReadGltfScene(GltfAsset::Parse(std::string(bytes), name, path.parent_path()), file.notes);
    RequireInRange(file.mesh, name);
    return file;
  }
  const MeshScan scan = Scan(format, bytes, name);
  const std::size_t num_polygons = scan.polygon_begin.size() - 1;
  if (num_polygons == 0) {
    throw Error(name, "has no face with three different corners", "Give a surface");
  }
  MeshFile file;
  TriangleMesh& mesh = file.mesh;
  mesh.vertices.resize(3, scan.positions.size());
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) mesh.vertices.col(v) = scan.positions[v];

  std::size_t num_split = 0;
  mesh.faces.resize(3, scan.polygon_ids.size() - 2 * num_polygons);
  Eigen::Index next = 0;
  for (std::size_t p = 0; p < num_polygons; ++p) {
    const int begin = scan.polygon_begin[p];
    const int end = scan.polygon_begin[p + 1];
    num_split += end - begin > 3;
    SplitPolygon(std::span(scan.polygon_ids).subspan(begin, end - begin),
                 [&](int a, int b, int c) { mesh.faces.col(next++) << a, b, c; });
  }
  RequireInRange(mesh, name);
  if (num_split > 0) {
    file.notes.push_back(fmt::format("{} of {} faces had more than three corners and were split.",
                                     num_split, num_polygons));
  }
  if (scan.num_left_out > 0) {
    file.notes.push_back(
        fmt::format("{} faces that repeat a corner were left out.", scan.num_left_out));
  }
  if (scan.num_unread > 0) {
    file.notes.push_back(fmt::format("{} byte{} after the triangles {} not read.", scan.num_unread,
                                     scan.num_unread == 1 ? "" : "s",
                                     scan.num_unread == 1 ? "was" : "were"));
  }
  return file;
}

bool HasMeshFormat(const fs::path& path) {
  const std::string extension = ExtensionOf(path);
  return extension == ".obj" || extension == ".ply" || extension == ".stl" || extension == ".off" ||
         IsGltf(extension);
}

TriangleMesh ReadMesh(const fs::path& path) { return ReadMeshFile(path).mesh; }

void WriteMesh(const TriangleMesh& mesh, const fs::path& path) {
  const std::string name = path.string();
  const std::string format = FormatOf(path, true);
  if (mesh.NumFaces() == 0) {
    throw Error(name, "cannot store a mesh without faces", "Give a surface");
  }
  RequireValid(mesh);
  if (!mesh.vertices.cast<float>().allFinite()) {
    throw Error(name, "cannot store coordinates beyond single precision", "Scale the mesh");
  }
  const bool binary = format == "ply" || format == "stl";
  // Significant digits for .off; .obj has a fixed number of decimals.
  const std::streamsize precision = format == "obj" ? 12 : 17;
  std::ostringstream stream;
  {
    // OpenMesh's writers are process-wide objects with state, and they report to a process-wide
    // stream: use them one at a time, and silently.
    static std::mutex mutex;
    const std::scoped_lock lock(mutex);
    const bool was_enabled = omlog().is_enabled();
    omlog().disable();
    SoupExporter soup(mesh);
    const om::IO::Options options(binary ? om::IO::Options::Binary : om::IO::Options::Default);
    const bool written = om::IO::IOManager().write(stream, format, soup, options, precision);
    if (was_enabled) omlog().enable();
    if (!written) throw Error(name, "could not be written as ." + format, "Try .ply");
  }
  WriteAtomically(path, stream.view());
}

}  // namespace holdfast
