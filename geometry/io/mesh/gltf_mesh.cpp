// SPDX-License-Identifier: MIT
#include "geometry/io/mesh/gltf_mesh.h"

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {
namespace {

constexpr int kTriangles = 4, kStrip = 5;  // a fan is 6; less are points and lines

bool IsPlain(const GltfAsset& asset, int accessor) {
  const GltfAccessor& found = asset.accessors[accessor];
  return found.view >= 0 && !asset.views[found.view].compressed;
}

Material MaterialOf(const GltfAsset& asset, int index, std::size_t& image_room,
                    std::vector<std::string>& notes) {
  if (index < 0) return ObjectMaterial();
  const GltfMaterial& from = asset.materials[index];
  Material material{from.name,
                    from.color.cwiseMax(0).cwiseMin(1),
                    std::clamp(from.metallic, 0.0, 1.0),
                    std::clamp(from.roughness, 0.0, 1.0),
                    {}};
  if (from.image < 0 || image_room == 0) return material;
  try {
    AddImage(asset.ImageBytes(from.image), fmt::format("of '{}'", from.name), image_room, material,
             notes);
  } catch (const Error& error) {
    notes.push_back(fmt::format("the image of '{}' is left out: {}", from.name, error.what()));
  }
  return material;
}

// Three corners per triangle, for a primitive with `vertices` vertices.
Eigen::Matrix3Xi FacesOf(const GltfAsset& asset, const GltfPrimitive& primitive,
                         Eigen::Index vertices) {
  if (primitive.indices < 0) {
    const Eigen::Index faces = vertices / 3;
    return Eigen::VectorXi::LinSpaced(3 * faces, 0, static_cast<int>(3 * faces) - 1)
        .reshaped(3, faces);
  }
  const GltfNumbers indices(asset, primitive.indices, 1);
  Eigen::Matrix3Xi faces(3, indices.Count() / 3);
  for (Eigen::Index k = 0; k < faces.size(); ++k) {
    faces(k) = static_cast<int>(indices(static_cast<std::size_t>(k), 0));
  }
  return faces;
}

// Values of an accessor with one element per vertex; empty for any other accessor.
Eigen::MatrixXd PerVertex(const GltfAsset& asset, int accessor, int rows, Eigen::Index vertices) {
  if (accessor < 0 || !IsPlain(asset, accessor)) return {};
  const GltfNumbers numbers(asset, accessor, rows);
  if (numbers.Count() != static_cast<std::size_t>(vertices)) return {};
  Eigen::MatrixXd values(rows, vertices);
  for (Eigen::Index i = 0; i < vertices; ++i) {
    for (int row = 0; row < rows; ++row) {
      values(row, i) = numbers(static_cast<std::size_t>(i), row);
    }
  }
  if (!values.allFinite()) return {};
  return values;
}

}  // namespace

TriangleMesh ReadGltfMesh(const GltfAsset& asset, int mesh) {
  std::map<std::array<double, 3>, int> vertices;
  std::vector<Eigen::Vector3d> places;
  std::vector<int> corners;
  // Accessors that several primitives share count once for each of them.
  std::size_t numbers = 0;
  for (const GltfPrimitive& primitive : asset.meshes[mesh].primitives) {
    if (primitive.mode < kTriangles || primitive.positions < 0) continue;
    if (!IsPlain(asset, primitive.positions)) return {};
    if (primitive.indices >= 0 && !IsPlain(asset, primitive.indices)) return {};
    const GltfNumbers positions(asset, primitive.positions, 3);
    numbers += positions.Count();
    std::vector<int> vertex_of(positions.Count());
    for (std::size_t i = 0; i < positions.Count(); ++i) {
      const std::array<double, 3> place = {positions(i, 0), positions(i, 1), positions(i, 2)};
      const Eigen::Vector3d at(place[0], place[1], place[2]);
      if (!at.allFinite()) {
        throw Error(fmt::format("{}[meshes][{}]", asset.Where(), mesh),
                    fmt::format("vertex {} is not finite", i), "Export the mesh again");
      }
      const auto [known, is_new] = vertices.try_emplace(place, static_cast<int>(places.size()));
      if (is_new) places.push_back(at);
      vertex_of[i] = known->second;
    }
    const auto add = [&](std::size_t index) {
      if (index >= vertex_of.size()) {
        throw Error(fmt::format("{}[meshes][{}]", asset.Where(), mesh),
                    fmt::format("a triangle has corner {} of {} vertices", index, vertex_of.size()),
                    "Export the mesh again");
      }
      corners.push_back(vertex_of[index]);
    };
    std::optional<GltfNumbers> indices;
    if (primitive.indices >= 0) numbers += indices.emplace(asset, primitive.indices, 1).Count();
    const std::size_t count = indices ? indices->Count() : positions.Count();
    for (std::size_t i = 0; i + 2 < count; i += primitive.mode == kTriangles ? 3 : 1) {
      const std::size_t turned = i % 2;
      const std::array<std::size_t, 3> places_of =
          primitive.mode == kTriangles ? std::array{i, i + 1, i + 2}
          : primitive.mode == kStrip   ? std::array{i, i + 1 + turned, i + 2 - turned}
                                       : std::array{i + 1, i + 2, std::size_t{0}};
      for (const std::size_t k : places_of) {
        add(indices ? static_cast<std::size_t>((*indices)(k, 0)) : k);
      }
    }
    if (numbers > asset.NumBytes()) {
      throw Error(fmt::format("{}[meshes][{}]", asset.Where(), mesh),
                  "has more corners than the file has bytes", "Export the mesh again");
    }
  }
  TriangleMesh result;
  result.vertices.resize(3, places.size());
  for (std::size_t v = 0; v < places.size(); ++v) {
    result.vertices.col(v) = places[v];
  }
  result.faces.resize(3, corners.size() / 3);
  std::copy(corners.begin(), corners.end(), result.faces.reshaped().begin());
  return result;
}

TriangleMesh ReadGltfScene(const GltfAsset& asset, std::vector<std::string>& notes) {
  std::vector<bool> shown(asset.nodes.size(), asset.scene_roots.empty());
  for (const int root : asset.scene_roots) shown[root] = true;
  std::vector<Eigen::Affine3d> world(asset.nodes.size());
  TriangleMesh scene;
  scene.vertices.resize(3, 0);
  scene.faces.resize(3, 0);
  int num_meshes = 0;
  for (const int node : asset.order) {
    const auto at = static_cast<std::size_t>(node);
    const GltfNode& from = asset.nodes[at];
    world[at] = from.Local();
    if (from.parent >= 0) {
      const auto parent = static_cast<std::size_t>(from.parent);
      world[at] = world[parent] * world[at];
      shown[at] = shown[at] || shown[parent];
    }
    if (!shown[at] || from.mesh < 0) continue;
    const GltfMesh& mesh = asset.meshes[from.mesh];
    for (const GltfPrimitive& primitive : mesh.primitives) {
      if (primitive.mode < kTriangles || primitive.positions < 0) continue;  // points, lines
      if (!IsPlain(asset, primitive.positions) ||
          (primitive.indices >= 0 && !IsPlain(asset, primitive.indices))) {
        throw Error(fmt::format("{}[meshes][{}]", asset.Where(), from.mesh), "is compressed",
                    "Export it without compression (Draco, meshopt)");
      }
    }
    TriangleMesh part = ReadGltfMesh(asset, from.mesh);
    if (part.NumFaces() == 0) continue;
    if (from.skin < 0) {
      part.vertices = world[at] * part.vertices;
      if (world[at].linear().determinant() < 0.0) part.faces.row(1).swap(part.faces.row(2));
    }
    Append(part, scene);
    ++num_meshes;
    // A mesh used by many nodes counts as many meshes.
    if (static_cast<std::size_t>(scene.faces.size()) > 16 * asset.NumBytes()) {
      throw Error(asset.Where(), "repeats its meshes too often", "Export only the object");
    }
  }
  if (num_meshes == 0) {
    throw Error(asset.Where(), "has no triangles in its default scene",
                "Give a surface: a mesh in a node of the scene");
  }
  notes.push_back(fmt::format(
      "{} placed by the nodes of the file; the axes are those of the file (glTF: y up).",
      num_meshes == 1 ? std::string("1 mesh is")
                      : fmt::format("{} meshes are joined, each", num_meshes)));
  return scene;
}

std::optional<TexturedMesh> ReadGltfLook(const GltfAsset& asset, int mesh) {
  const GltfMesh& from = asset.meshes[mesh];
  const bool has_look =
      std::ranges::any_of(from.primitives,
                          [](const GltfPrimitive& primitive) { return primitive.material >= 0; }) &&
      std::ranges::none_of(from.primitives, [](const GltfPrimitive& primitive) {
        return primitive.mode > kTriangles;  // strips and fans
      });
  if (!has_look || ReadGltfMesh(asset, mesh).NumFaces() == 0) return std::nullopt;
  TexturedMesh look;
  std::map<int, int> material_of;
  std::size_t image_room = kMaterialImagesRoom;
  for (const GltfPrimitive& primitive : from.primitives) {
    if (primitive.mode != kTriangles || primitive.positions < 0) continue;
    const auto [material, is_new] =
        material_of.try_emplace(primitive.material, static_cast<int>(look.materials.size()));
    if (is_new)
      look.materials.push_back(MaterialOf(asset, primitive.material, image_room, look.notes));
    const GltfNumbers positions(asset, primitive.positions, 3);
    const auto vertices = static_cast<Eigen::Index>(positions.Count());
    TexturedMesh::Part part;
    part.material = material->second;
    part.mesh.vertices = PerVertex(asset, primitive.positions, 3, vertices);
    part.mesh.faces = FacesOf(asset, primitive, vertices);
    part.normals = PerVertex(asset, primitive.normals, 3, vertices);
    if (part.normals.size() == 0) part.normals = VertexNormals(part.mesh);
    for (auto normal : part.normals.colwise()) {
      normal =
          normal.norm() > 1e-9 ? Eigen::Vector3d(normal.normalized()) : Eigen::Vector3d::UnitY();
    }
    const Eigen::MatrixXd uv = PerVertex(asset, primitive.uv, 2, vertices);
    if (uv.size() > 0) {
      part.uv = uv;
      part.uv.row(1) = 1.0 - part.uv.row(1).array();  // glTF's v points down
    }
    look.parts.push_back(std::move(part));
  }
  return look;
}

}  // namespace holdfast
