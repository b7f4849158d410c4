// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "geometry/io/gltf/gltf_reader.h"
#include "geometry/io/mesh/textured_mesh.h"

namespace holdfast {

/// Writes the glTF at `character` as a .glb whose skeleton moves as in `motion` (joints in the
/// order of `rig`; `pelvis` and its descendants move). One animation replaces those of the file;
/// its meshes, materials and images are kept, external buffers and images are embedded. `object`
/// moves as the motion's prop; both may be missing. `animation` is its name, `generator` becomes
/// `asset.generator`. Throws Error if a file cannot be read or written.
void WriteGltfOnto(const std::filesystem::path& character, const GltfAsset& asset,
                   const GltfRig& rig, const SourceMotion& motion, int pelvis,
                   const TexturedMesh* object, const std::string& animation,
                   const std::string& generator, const std::filesystem::path& path);

}  // namespace holdfast
