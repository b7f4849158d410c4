// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "geometry/io/gltf/asset/gltf_asset.h"
#include "geometry/io/mesh/textured_mesh.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Returns the triangles of a mesh in its own frame. Corners at the same position, which glTF
/// separates for normals and colors, become one vertex again. Empty for a mesh that is compressed
/// or has no triangles. Throws Error for indices out of range and positions that are not finite.
TriangleMesh ReadGltfMesh(const GltfAsset& asset, int mesh);

/// Returns all meshes of the displayed scene as one, each placed by its nodes in the pose of the
/// file (a mesh with a skin as it was skinned); axes and unit as in the file: y up, meters. `notes`
/// reports what was done. Throws Error if there is no triangle, for compressed meshes, and as
/// ReadGltfMesh does.
TriangleMesh ReadGltfScene(const GltfAsset& asset, std::vector<std::string>& notes);

/// Returns the appearance of that mesh: its materials (base color, metallic, roughness, and PNG or
/// JPEG images), texture coordinates and normals; its notes list what was left out. nullopt for a
/// mesh without materials, with strips or fans, or for which ReadGltfMesh is empty. Throws as
/// ReadGltfMesh does.
std::optional<TexturedMesh> ReadGltfLook(const GltfAsset& asset, int mesh);

}  // namespace holdfast
