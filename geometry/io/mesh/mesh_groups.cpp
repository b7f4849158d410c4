// SPDX-License-Identifier: MIT
#include "geometry/io/mesh/mesh_groups.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/mesh/mesh_scan.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// A triangle by the positions of its corners.
using Corners = Eigen::Matrix3d;

TriangleMesh SurfaceOf(const std::vector<Corners>& triangles) {
  TriangleMesh mesh;
  const auto count = static_cast<Eigen::Index>(triangles.size());
  mesh.vertices.resize(3, 3 * count);
  mesh.faces.resize(3, count);
  for (Eigen::Index f = 0; f < count; ++f) {
    mesh.vertices.middleCols<3>(3 * f) = triangles[static_cast<std::size_t>(f)];
    const int first = static_cast<int>(3 * f);
    mesh.faces.col(f) << first, first + 1, first + 2;
  }
  return mesh;
}

std::string Bytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw Error(path.string(), "cannot be read", "Check that it is a file");
  return std::move(text).str();
}

// Assigns faces to groups while an .obj file is read.
class Sorter {
 public:
  void Open(MeshGroup::Kind kind, const std::vector<std::string>& names) {
    std::erase_if(open_, [&](std::size_t i) { return groups_[i].kind == kind; });
    for (const std::string& name : names) {
      const auto same = [&](const MeshGroup& group) {
        return group.kind == kind && group.name == name;
      };
      const auto found = std::ranges::find_if(groups_, same);
      open_.push_back(static_cast<std::size_t>(found - groups_.begin()));
      if (found != groups_.end()) continue;
      groups_.push_back({kind, name, {}});
      triangles_.emplace_back();
    }
  }

  void Add(const Corners& triangle) {
    for (const std::size_t i : open_) triangles_[i].push_back(triangle);
  }

  std::vector<MeshGroup> Take() {
    std::vector<MeshGroup> filled;
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      if (triangles_[i].empty()) continue;
      groups_[i].surface = SurfaceOf(triangles_[i]);
      filled.push_back(std::move(groups_[i]));
    }
    return filled;
  }

 private:
  std::vector<MeshGroup> groups_;
  std::vector<std::vector<Corners>> triangles_;
  std::vector<std::size_t> open_;
};

std::vector<std::string> Words(std::istringstream& line) {
  std::vector<std::string> words;
  for (std::string word; line >> word;) words.push_back(word);
  return words;
}

// A name may contain blanks, except for `g`, which may give several names.
std::vector<std::string> OneName(std::istringstream& line) {
  std::string name;
  for (const std::string& word : Words(line)) name += (name.empty() ? "" : " ") + word;
  return name.empty() ? std::vector<std::string>{} : std::vector{name};
}

}  // namespace

std::vector<MeshGroup> ReadMeshGroups(const fs::path& path) {
  const TriangleMesh mesh = ReadMesh(path);  // throws for all that could go wrong below
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".obj") return {};
  Sorter sorter;
  std::istringstream text(PlainLines(Bytes(path), true));
  int seen = 0;
  for (std::string whole; std::getline(text, whole);) {
    std::istringstream line(whole.substr(0, whole.find('#')));
    std::string keyword;
    line >> keyword;
    seen += keyword == "v";
    if (keyword == "g") sorter.Open(MeshGroup::Kind::kGroup, Words(line));
    if (keyword == "o") sorter.Open(MeshGroup::Kind::kObject, OneName(line));
    if (keyword == "usemtl") sorter.Open(MeshGroup::Kind::kMaterial, OneName(line));
    if (keyword != "f") continue;
    std::vector<int> polygon;
    for (const std::string& word : Words(line)) {
      const int id = std::atoi(word.c_str());
      const int vertex = id > 0 ? id - 1 : seen + id;
      if (vertex >= 0 && vertex < mesh.NumVertices()) polygon.push_back(vertex);
    }
    for (std::size_t k = 2; k < polygon.size(); ++k) {
      Corners triangle;
      triangle << mesh.vertices.col(polygon[0]), mesh.vertices.col(polygon[k - 1]),
          mesh.vertices.col(polygon[k]);
      sorter.Add(triangle);
    }
  }
  return sorter.Take();
}

TriangleMesh ReadVertexRegion(const fs::path& path, const TriangleMesh& mesh) {
  std::istringstream text(Bytes(path));
  std::vector<bool> listed(static_cast<std::size_t>(mesh.NumVertices()), false);
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    line.resize(std::min(line.size(), line.find('#')));
    std::ranges::replace(line, ',', ' ');
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      int id = -1;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), id);
      if (error != std::errc() || end != word.data() + word.size() || id < 0 ||
          id >= mesh.NumVertices()) {
        throw Error(fmt::format("{}:{}", path.string(), number),
                    fmt::format("'{}' is not a vertex of the mesh", word.substr(0, 32)),
                    fmt::format("A list of vertices has their numbers, 0 to {}, between blanks",
                                mesh.NumVertices() - 1));
      }
      listed[static_cast<std::size_t>(id)] = true;
    }
  }
  std::vector<Corners> triangles;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    int corners = 0;
    for (int k = 0; k < 3; ++k) corners += listed[static_cast<std::size_t>(mesh.faces(k, f))];
    if (corners < 2) continue;
    Corners triangle;
    for (int k = 0; k < 3; ++k) triangle.col(k) = mesh.vertices.col(mesh.faces(k, f));
    triangles.push_back(triangle);
  }
  if (triangles.empty()) {
    throw Error(path.string(), "lists no vertices of which any face has two",
                "Give the numbers of all vertices of the region, counted from 0");
  }
  return SurfaceOf(triangles);
}

}  // namespace holdfast
