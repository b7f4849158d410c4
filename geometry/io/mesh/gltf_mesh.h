// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "geometry/io/gltf/asset/gltf_asset.h"
#include "geometry/io/mesh/textured_mesh.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// The triangles of a mesh in its own frame. Corners at the same place, which glTF parts for the
/// sake of normals and colors, become one vertex again. Empty for a mesh that is compressed or has
/// no triangles. Throws Error for indices out of range and places that are not finite.
TriangleMesh ReadGltfMesh(const GltfAsset& asset, int mesh);

/// All meshes of the scene that a file shows as one, each placed by its nodes as the file poses
/// them (one with a skin as it was skinned); axes and unit as in the file: y up, meters. `notes`
/// gets what was done. Throws Error where there is no triangle, for meshes that are compressed, and
/// as ReadGltfMesh does.
TriangleMesh ReadGltfScene(const GltfAsset& asset, std::vector<std::string>& notes);

/// How that mesh looks: its materials (base color, metallic, roughness, and images that are PNG or
/// JPEG), texture coordinates and normals; what of it was left out is in its notes. Nothing for a
/// mesh without materials, of strips or fans, and one that ReadGltfMesh has nothing of. Throws as
/// ReadGltfMesh does.
std::optional<TexturedMesh> ReadGltfLook(const GltfAsset& asset, int mesh);

}  // namespace holdfast
