// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_mesh.h"

#include <array>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr int kTriangles = 4;

bool IsPlain(const GltfAsset& asset, int accessor) {
  const GltfAccessor& found = asset.accessors[static_cast<std::size_t>(accessor)];
  return found.view >= 0 && !asset.views[static_cast<std::size_t>(found.view)].compressed;
}

}  // namespace

TriangleMesh ReadGltfMesh(const GltfAsset& asset, int mesh) {
  std::map<std::array<double, 3>, int> vertices;
  std::vector<Eigen::Vector3d> places;
  std::vector<int> corners;
  // What parts of a mesh share would be told again for each of them.
  std::size_t numbers = 0;
  for (const GltfPrimitive& primitive : asset.meshes[static_cast<std::size_t>(mesh)].primitives) {
    if (primitive.mode != kTriangles || primitive.positions < 0) continue;
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
    if (primitive.indices >= 0) {
      const GltfNumbers indices(asset, primitive.indices, 1);
      numbers += indices.Count();
      for (std::size_t i = 0; i + 2 < indices.Count(); i += 3) {
        for (std::size_t k = 0; k < 3; ++k) add(static_cast<std::size_t>(indices(i + k, 0)));
      }
    } else {
      for (std::size_t i = 0; i + 2 < positions.Count(); i += 3) {
        for (std::size_t k = 0; k < 3; ++k) add(i + k);
      }
    }
    if (numbers > asset.NumBytes()) {
      throw Error(fmt::format("{}[meshes][{}]", asset.Where(), mesh),
                  "has more corners than the file has bytes", "Export the mesh again");
    }
  }
  TriangleMesh result;
  result.vertices.resize(3, static_cast<Eigen::Index>(places.size()));
  for (std::size_t v = 0; v < places.size(); ++v) {
    result.vertices.col(static_cast<Eigen::Index>(v)) = places[v];
  }
  result.faces.resize(3, static_cast<Eigen::Index>(corners.size() / 3));
  std::copy(corners.begin(), corners.end(), result.faces.reshaped().begin());
  return result;
}

}  // namespace holdfast
