// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "geometry/io/gltf/gltf_reader.h"
#include "geometry/io/mesh/textured_mesh.h"

namespace holdfast {

struct GltfOntoNames {
  std::string animation;
  std::string generator = "Holdfast";  ///< `asset.generator`
};

/// Writes the glTF at `character` as a .glb in which its skeleton moves as `motion` does (joints in
/// the order of `rig`, `pelvis` and what hangs on it): one animation in place of those it had, its
/// meshes, materials and images as they were, buffers and images beside the file taken in. `object`
/// moves along the motion's prop; both may be missing. Throws Error when a file cannot be read or
/// written.
void WriteGltfOnto(const std::filesystem::path& character, const GltfAsset& asset,
                   const GltfRig& rig, const SourceMotion& motion, int pelvis,
                   const TexturedMesh* object, const GltfOntoNames& names,
                   const std::filesystem::path& path);

}  // namespace holdfast
