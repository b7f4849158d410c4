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
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_scan.h"
#include "geometry/io/mesh/openmesh_soup.h"
#include "geometry/mesh/mesh_parts.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
namespace om = OpenMesh;

/// OpenMesh's readers and writers are objects with state of which there is one per process, and
/// they report to streams of the process. One at a time, and in silence.
class OpenMeshSession {
 public:
  OpenMeshSession() : lock_(Mutex()) {
    for (om::mostream* stream : Streams()) {
      was_enabled_.push_back(stream->is_enabled());
      stream->disable();
    }
  }
  ~OpenMeshSession() {
    const std::vector<om::mostream*> streams = Streams();
    for (std::size_t i = 0; i < streams.size(); ++i) {
      if (was_enabled_[i]) streams[i]->enable();
    }
  }
  OpenMeshSession(const OpenMeshSession&) = delete;
  OpenMeshSession& operator=(const OpenMeshSession&) = delete;

 private:
  static std::mutex& Mutex() {
    static std::mutex mutex;
    return mutex;
  }
  static std::vector<om::mostream*> Streams() { return {&omerr(), &omlog(), &omout()}; }

  std::scoped_lock<std::mutex> lock_;
  std::vector<bool> was_enabled_;
};

/// ".OBJ" -> "obj". Throws Error unless it is a format we know.
std::string FormatOf(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension != ".obj" && extension != ".ply" && extension != ".stl" && extension != ".off") {
    throw Error(path.string(),
                extension.empty() ? "has no extension to tell its format"
                                  : fmt::format("'{}' is not a mesh format known here", extension),
                "Use .obj, .ply, .stl or .off");
  }
  return extension.substr(1);
}

/// Triangles of a polygon: a fan around its first corner, and for many corners halves of halves,
/// so that no vertex gets more than some twenty of them.
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
  FormatOf(path);  // an unknown format is said before a large file is read
  // Every corner takes a byte or more, so that ids of corners stay within an int.
  return ReadMeshBytes(ReadFile(path, std::numeric_limits<int>::max()), path);
}

MeshFile ReadMeshBytes(std::string bytes, const fs::path& path) {
  const std::string name = path.string();
  const std::string format = FormatOf(path);
  if (bytes.empty()) throw Error(name, "is empty", "Copy or export it again");
  MeshScan scan = Scan(format, bytes, name);
  if (!scan.plain.empty()) bytes = std::move(scan.plain);

  // Loose corners of .stl files become vertices there; all other positions are known already.
  const bool is_stl = format == "stl";
  const std::size_t num_expected = is_stl ? scan.num_triangles : scan.polygon_begin.size() - 1;
  SoupImporter soup(is_stl, num_expected, is_stl ? 3 * num_expected : scan.polygon_ids.size());
  {
    const OpenMeshSession session;
    om::IO::Options options(om::IO::Options::Binary);
    std::istringstream stream(std::move(bytes));
    if (!om::IO::IOManager().read(stream, std::string(scan.format), soup, options)) {
      throw Error(name, "cannot be read as ." + format, "Check the file, or export it again");
    }
  }

  MeshFile file;
  TriangleMesh& mesh = file.mesh;
  const std::vector<Eigen::Vector3d>& positions = is_stl ? soup.positions : scan.positions;
  const std::size_t num_polygons = soup.polygon_begin.size() - 1;
  if (soup.n_vertices() != positions.size() || num_polygons > num_expected ||
      (!is_stl && num_polygons < num_expected)) {
    throw Error(name, "was read in part only", "Convert it to .ply, or export it again");
  }
  const std::size_t num_left_out = scan.num_left_out + num_expected - num_polygons;
  if (num_polygons == 0) {
    throw Error(name, "has no face with three different corners", "A surface is needed");
  }
  mesh.vertices.resize(3, static_cast<Eigen::Index>(positions.size()));
  for (std::size_t v = 0; v < positions.size(); ++v) mesh.vertices.col(v) = positions[v];

  std::size_t num_split = 0;
  mesh.faces.resize(3, static_cast<Eigen::Index>(soup.polygon_ids.size() - 2 * num_polygons));
  Eigen::Index next = 0;
  for (std::size_t p = 0; p < num_polygons; ++p) {
    const int begin = soup.polygon_begin[p];
    const int end = soup.polygon_begin[p + 1];
    num_split += end - begin > 3;
    SplitPolygon(std::span(soup.polygon_ids).subspan(begin, end - begin),
                 [&](int a, int b, int c) { mesh.faces.col(next++) << a, b, c; });
  }
  RequireInRange(mesh, name);
  if (num_split > 0) {
    file.notes.push_back(fmt::format("{} of {} faces had more than three corners and were split.",
                                     num_split, num_polygons));
  }
  if (num_left_out > 0) {
    file.notes.push_back(fmt::format("{} faces that repeat a corner were left out.", num_left_out));
  }
  return file;
}

TriangleMesh ReadMesh(const fs::path& path) { return ReadMeshFile(path).mesh; }

void WriteMesh(const TriangleMesh& mesh, const fs::path& path) {
  const std::string name = path.string();
  const std::string format = FormatOf(path);
  if (mesh.NumFaces() == 0) {
    throw Error(name, "a mesh without faces was to be written", "Give a surface");
  }
  RequireValid(mesh);
  if (!mesh.vertices.cast<float>().allFinite()) {
    throw Error(name, "coordinates beyond single precision were to be written", "Scale the mesh");
  }
  const bool binary = format == "ply" || format == "stl";
  // Significant digits for .off; .obj has a fixed number of decimals.
  const std::streamsize precision = format == "obj" ? 12 : 17;
  std::ostringstream stream;
  {
    const OpenMeshSession session;
    SoupExporter soup(mesh);
    const om::IO::Options options(binary ? om::IO::Options::Binary : om::IO::Options::Default);
    if (!om::IO::IOManager().write(stream, format, soup, options, precision)) {
      throw Error(name, "could not be written as ." + format, "Try .ply");
    }
  }
  WriteAtomically(path, stream.view());
}

}  // namespace holdfast
