// SPDX-License-Identifier: MIT
#include "geometry/io/mesh/textured_mesh.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <Eigen/LU>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/mesh/mesh_scan.h"
#include "geometry/mesh/mesh_topology.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxImageBytes = std::size_t{256} << 20;
constexpr std::size_t kMaxMaterialBytes = std::size_t{16} << 20;

std::string Trimmed(std::string text) {
  const auto blank = [](unsigned char c) { return std::isspace(c) != 0; };
  text.erase(std::find_if_not(text.rbegin(), text.rend(), blank).base(), text.end());
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), blank));
  return text;
}

// Finds the file that `name` refers to, in the mesh's folder or below it; empty if there is none.
fs::path FileBeside(const fs::path& folder, std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  const fs::path told(name);
  const bool leads_away = told.is_absolute() || name.find(':') != std::string::npos ||
                          std::find(told.begin(), told.end(), "..") != told.end();
  std::error_code ignored;
  for (const fs::path& path : {leads_away ? fs::path() : folder / told, folder / told.filename()}) {
    if (!path.empty() && fs::is_regular_file(path, ignored)) return path;
  }
  return {};
}

// Returns the text after the options (-s 1 1 1, -clamp on) of a texture statement.
std::string ImageName(std::istringstream& line) {
  std::string word, rest;
  while (line >> std::ws && line.peek() == '-') {
    line >> word;
    int most = 1;
    if (word == "-o" || word == "-s" || word == "-t") most = 3;
    if (word == "-mm") most = 2;
    double number;
    for (int k = 0; k < most; ++k) {
      const auto before = line.tellg();
      line >> word;
      if (k > 0 && !ParseNumber(word, number)) {
        line.seekg(before);
        break;
      }
    }
  }
  std::getline(line, rest);
  return Trimmed(rest);
}

class ObjReader {
 public:
  explicit ObjReader(const fs::path& path) : folder_(path.parent_path()) {
    ReadMeshFile(path);  // rejects malformed files
    std::istringstream lines(PlainLines(ReadFile(path), true));
    std::string text, keyword;
    while (std::getline(lines, text)) {
      std::istringstream line(text);
      if (!(line >> keyword)) continue;
      if (keyword == "v") {
        Eigen::Vector3d& p = positions_.emplace_back();
        line >> p.x() >> p.y() >> p.z();
      } else if (keyword == "vt") {
        Eigen::Vector2d& uv = uv_.emplace_back(0, 0);
        line >> uv.x() >> uv.y();
        if (!uv.allFinite()) uv.setZero();
      } else if (keyword == "f") {
        AddFace(line);
      } else if (keyword == "usemtl" || keyword == "mtllib") {
        std::string name;
        std::getline(line, name);
        if (keyword == "usemtl") {
          material_ = MaterialOf(Trimmed(name));
        } else {
          ReadMaterials(Trimmed(name));
        }
      }
    }
  }

  bool HasLook() const { return has_uv_ || !mesh_.materials.empty(); }

  TexturedMesh Build(double scale) {
    TriangleMesh all;
    all.vertices.resize(3, positions_.size());
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      all.vertices.col(v) = scale * positions_[v];
    }
    all.faces = Eigen::Map<const Eigen::Matrix3Xi>(corners_.data(), 3,
                                                   static_cast<Eigen::Index>(faces_.size()));
    const ShadedMesh shaded = SplitAtCreases(all);
    mesh_.materials.emplace_back();  // for faces without one
    std::vector<std::vector<Eigen::Index>> faces_of(mesh_.materials.size());
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      const std::size_t last = faces_of.size() - 1;
      faces_of[faces_[f] < 0 ? last : static_cast<std::size_t>(faces_[f])].push_back(
          static_cast<Eigen::Index>(f));
    }
    for (std::size_t material = 0; material < faces_of.size(); ++material) {
      if (!faces_of[material].empty()) AddPart(shaded, faces_of[material], material);
    }
    return std::move(mesh_);
  }

 private:
  // Ids count from 1; negative ids count backward from the last one `seen`. -1 for none.
  static int Id(std::string_view word, std::size_t seen) {
    double id = 0;
    if (!ParseNumber(word, id) || id == 0) return -1;
    id += id < 0 ? static_cast<double>(seen) : -1;
    return id >= 0 && id < std::numeric_limits<int>::max() ? static_cast<int>(id) : -1;
  }

  void AddFace(std::istringstream& line) {
    std::vector<std::pair<int, int>> corners;  // position, texture coordinate
    std::string word;
    while (line >> word && word[0] != '#') {
      const std::size_t slash = std::min(word.find('/'), word.size());
      const std::string_view uv = std::string_view(word).substr(std::min(slash + 1, word.size()));
      const int at = Id(std::string_view(word).substr(0, slash), positions_.size());
      corners.emplace_back(at, Id(uv.substr(0, uv.find('/')), uv_.size()));
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
      const auto [a, b, c] = std::tuple(corners[0], corners[k - 1], corners[k]);
      if (a.first == b.first || b.first == c.first || c.first == a.first) continue;
      for (const auto& [position, uv] : {a, b, c}) {
        corners_.push_back(position);
        corner_uv_.push_back(uv);
        has_uv_ = has_uv_ || uv >= 0;
      }
      faces_.push_back(material_);
    }
  }

  int MaterialOf(const std::string& name) {
    const auto [at, is_new] =
        material_of_.try_emplace(name, static_cast<int>(mesh_.materials.size()));
    if (is_new) mesh_.materials.emplace_back().name = name;
    return at->second;
  }

  void ReadMaterials(const std::string& name) {
    const fs::path path = FileBeside(folder_, name);
    if (path.empty()) {
      mesh_.notes.push_back(fmt::format("the material file '{}' is not beside the mesh", name));
      return;
    }
    std::istringstream lines(ReadFile(path, kMaxMaterialBytes));
    std::string text, keyword;
    Material* material = nullptr;
    while (std::getline(lines, text)) {
      std::istringstream line(text);
      if (!(line >> keyword)) continue;
      if (keyword == "newmtl") {
        std::string called;
        std::getline(line, called);
        material = &mesh_.materials[MaterialOf(Trimmed(called))];
      } else if (material != nullptr) {
        SetMaterial(keyword, line, *material);
      }
    }
  }

  void SetMaterial(const std::string& keyword, std::istringstream& line, Material& material) {
    const auto fraction = [&] {
      double value = 0;
      line >> value;
      return std::isfinite(value) ? std::clamp(value, 0.0, 1.0) : 0.0;
    };
    if (keyword == "Kd" && material.image.empty()) {
      for (int c = 0; c < 3; ++c) material.color[c] = fraction();
    } else if (keyword == "d") {
      material.color[3] = fraction();
    } else if (keyword == "Tr") {
      material.color[3] = 1 - fraction();
    } else if (keyword == "Pr") {
      material.roughness = fraction();
    } else if (keyword == "Pm") {
      material.metallic = fraction();
    } else if (keyword == "Ns") {
      double exponent = 0;
      line >> exponent;
      // As in Blender.
      if (std::isfinite(exponent)) {
        material.roughness = 1 - std::sqrt(std::clamp(exponent / 1000, 0.0, 1.0));
      }
    } else if (keyword == "map_Kd") {
      ReadImage(ImageName(line), material);
    }
  }

  void ReadImage(const std::string& name, Material& material) {
    const fs::path path = FileBeside(folder_, name);
    if (path.empty()) {
      mesh_.notes.push_back(fmt::format("the image '{}' is not beside the mesh", name));
      return;
    }
    if (image_room_ == 0) return;
    if (AddImage(ReadFile(path, kMaxImageBytes), fmt::format("'{}'", name), image_room_, material,
                 mesh_.notes)) {
      material.color.head<3>().setOnes();  // the image has the color
    }
  }

  void AddPart(const ShadedMesh& shaded, const std::vector<Eigen::Index>& faces,
               std::size_t material) {
    TexturedMesh::Part part;
    part.material = static_cast<int>(material);
    part.mesh.faces.resize(3, faces.size());
    std::map<std::pair<int, int>, int> vertex_of;  // by shaded vertex and texture coordinate
    std::vector<std::pair<int, int>> vertices;
    bool has_uv = false;
    for (Eigen::Index f = 0; f < part.mesh.faces.cols(); ++f) {
      const Eigen::Index face = faces[f];
      for (int k = 0; k < 3; ++k) {
        int uv = corner_uv_[static_cast<std::size_t>(3 * face + k)];
        if (uv >= static_cast<int>(uv_.size())) uv = -1;
        const std::pair key{shaded.mesh.faces(k, face), uv};
        const auto [at, is_new] = vertex_of.try_emplace(key, static_cast<int>(vertices.size()));
        if (is_new) vertices.push_back(key);
        part.mesh.faces(k, f) = at->second;
        has_uv = has_uv || uv >= 0;
      }
    }
    const auto n = static_cast<Eigen::Index>(vertices.size());
    part.mesh.vertices.resize(3, n);
    part.normals.resize(3, n);
    if (has_uv) part.uv = Eigen::Matrix2Xd::Zero(2, n);
    for (Eigen::Index v = 0; v < n; ++v) {
      const auto [corner, uv] = vertices[v];
      part.mesh.vertices.col(v) = shaded.mesh.vertices.col(corner);
      part.normals.col(v) = shaded.normals.col(corner);
      if (uv >= 0) part.uv.col(v) = uv_[uv];
    }
    mesh_.parts.push_back(std::move(part));
  }

  fs::path folder_;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<Eigen::Vector2d> uv_;
  std::vector<int> corners_, corner_uv_;  // three per triangle
  std::vector<int> faces_;                // material of each triangle, -1 for none
  std::map<std::string, int> material_of_;
  int material_ = -1;
  bool has_uv_ = false;
  std::size_t image_room_ = kMaterialImagesRoom;
  TexturedMesh mesh_;
};

}  // namespace

bool AddImage(std::string bytes, std::string_view name, std::size_t& room, Material& material,
              std::vector<std::string>& notes) {
  if (bytes.size() > room) {
    notes.push_back(fmt::format(
        "the image {} and those after it are ignored: together they are too large", name));
    room = 0;
    return false;
  }
  room -= bytes.size();
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n") && !bytes.starts_with("\xff\xd8\xff")) {
    notes.push_back(fmt::format("the image {} is neither PNG nor JPEG", name));
    return false;
  }
  material.image = std::move(bytes);
  return true;
}

void Transform(const Eigen::Matrix3d& A, TexturedMesh& mesh) {
  for (TexturedMesh::Part& part : mesh.parts) {
    part.mesh.vertices = (A * part.mesh.vertices).eval();
    if (A.determinant() < 0) part.mesh.faces.row(1).swap(part.mesh.faces.row(2));
    if (std::abs(A.determinant()) < 1e-30) continue;
    part.normals = (A.inverse().transpose() * part.normals).eval();
    part.normals.colwise().normalize();
  }
}

TexturedMesh PlainMesh(const TriangleMesh& mesh, Material material) {
  ShadedMesh shaded = SplitAtCreases(mesh);
  TexturedMesh plain;
  plain.materials.push_back(std::move(material));
  plain.parts.push_back({std::move(shaded.mesh), std::move(shaded.normals), {}, 0});
  return plain;
}

std::optional<TexturedMesh> ReadTexturedObj(const fs::path& path, double scale) {
  ObjReader reader(path);
  if (!reader.HasLook()) return std::nullopt;
  return reader.Build(scale);
}

namespace {

// A triangle by the positions of its corners.
using Corners = Eigen::Matrix3d;

TriangleMesh SurfaceOf(const std::vector<Corners>& triangles) {
  TriangleMesh mesh;
  const auto count = static_cast<Eigen::Index>(triangles.size());
  mesh.vertices.resize(3, 3 * count);
  mesh.faces.resize(3, count);
  for (Eigen::Index f = 0; f < count; ++f) {
    mesh.vertices.middleCols<3>(3 * f) = triangles[f];
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
  if (!EqualIgnoringCase(path.extension().string(), ".obj")) return {};
  std::vector<MeshGroup> groups;
  std::vector<std::vector<Corners>> triangles;                          // of each group
  std::vector<std::size_t> open;                                        // groups of the next faces
  std::vector<std::string> keyword_of;                                  // of each group
  std::map<std::pair<std::string, std::string>, std::size_t> index_of;  // by keyword and name
  const auto begin = [&](const std::string& keyword, const std::vector<std::string>& names) {
    std::erase_if(open, [&](std::size_t i) { return keyword_of[i] == keyword; });
    for (const std::string& name : names) {
      const auto [at, is_new] = index_of.try_emplace({keyword, name}, groups.size());
      open.push_back(at->second);
      if (!is_new) continue;
      groups.push_back({name, {}});
      triangles.emplace_back();
      keyword_of.push_back(keyword);
    }
  };
  std::istringstream text(PlainLines(Bytes(path), true));
  int seen = 0;
  for (std::string whole; std::getline(text, whole);) {
    std::istringstream line(whole.substr(0, whole.find('#')));
    std::string keyword;
    line >> keyword;
    seen += keyword == "v";
    if (keyword == "g") begin(keyword, Words(line));
    if (keyword == "o" || keyword == "usemtl") begin(keyword, OneName(line));
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
      for (const std::size_t i : open) triangles[i].push_back(triangle);
    }
  }
  for (std::size_t i = 0; i < groups.size(); ++i) groups[i].surface = SurfaceOf(triangles[i]);
  std::erase_if(groups, [](const MeshGroup& group) { return group.surface.NumFaces() == 0; });
  return groups;
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
                    fmt::format("List vertex numbers, 0 to {}, separated by blanks",
                                mesh.NumVertices() - 1));
      }
      listed[id] = true;
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
    throw Error(path.string(), "lists no two vertices of the same face",
                "Give the numbers of all vertices of the region, counted from 0");
  }
  return SurfaceOf(triangles);
}

}  // namespace holdfast
