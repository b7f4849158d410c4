// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/io/gltf/gltf_asset.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// The triangles of a mesh in its own frame. Corners at the same place, which glTF parts for the
/// sake of normals and colours, become one vertex again. Empty for a mesh that is compressed or has
/// no triangles. Throws Error for indices out of range and places that are not finite.
TriangleMesh ReadGltfMesh(const GltfAsset& asset, int mesh);

}  // namespace holdfast
