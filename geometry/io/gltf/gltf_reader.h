// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/io/gltf/asset/gltf_asset.h"
#include "geometry/io/gltf/asset/gltf_container.h"  // LooksLikeGltf
#include "geometry/io/motion/motion_file.h"

namespace holdfast {

struct GltfMotionOptions {
  double frame_rate = 0;       ///< Hz; 0: rate of the keys
  double meters_per_unit = 1;  ///< glTF's unit is the meter
  std::string animation;       ///< by name; empty: the longest that moves the character
  std::string character;       ///< by name of its skin, mesh or topmost joint; empty: the only one
  std::string prop;  ///< node of the object next to the body; empty: the only one that moves
};

/// Reads an animated character from a .glb or .gltf (buffers embedded or in separate files; plain
/// or gzipped) and samples it at a frame rate. Rotations are relative to the bind pose (the skin's
/// inverse bind matrices, else the pose of the file): with all rotations zero, the character rests
/// as it was skinned. A mesh without skin that moves outside the skeleton becomes the motion's
/// prop, with its materials and images. Those of the character, morph targets, cameras and lights
/// are ignored.
///
/// Throws Error for files that are malformed or hold no animation or no character, for names that
/// do not exist, for several characters if none is named, and for motions whose frames would take
/// more than ten times the file's size plus 48 MB of memory. Notes of the result report choices and
/// oddities. `humanoid` is VRM's map, of version 0.x or 1.0.
SourceMotion ReadGltfMotion(const std::filesystem::path& path,
                            const GltfMotionOptions& options = {});

/// Same for a file's bytes; buffers with a file name are searched in `folder`.
SourceMotion ParseGltfMotion(std::string bytes, const std::string& where,
                             const std::filesystem::path& folder,
                             const GltfMotionOptions& options = {});

/// The skeleton of a character, to be animated by another motion.
struct GltfRig {
  SourceMotion motion;                          ///< motion of the file; one frame if it has none
  std::vector<int> nodes;                       ///< node of each joint
  std::vector<Eigen::Matrix3d> rest_rotations;  ///< of each joint's node in the bind pose
};

/// Returns the skinned character of a file: the one that its animation moves, else the only one.
/// Throws Error as ReadGltfMotion does, and for files with neither a skin nor VRM's bone map.
GltfRig ReadGltfRig(const GltfAsset& asset);

}  // namespace holdfast
