// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/io/gltf/asset/gltf_asset.h"
#include "geometry/io/motion/motion_file.h"

namespace holdfast {

/// Joints that belong together: those of all skins that share a joint or hang in one another.
struct GltfCharacter {
  std::string name;                     ///< of its skin, its mesh or its topmost joint
  std::vector<int> joints;              ///< nodes, ascending
  std::map<int, Eigen::Affine3d> bind;  ///< joint to mesh at rest, where the file tells
};

/// The characters of a file by its skins, in the file's order. Throws Error for inverse bind
/// matrices that are missing for some joints or not finite.
std::vector<GltfCharacter> FindCharacters(const GltfAsset& asset);

/// Nodes that are animated without any skin, taken for a character ("animation only" exports).
GltfCharacter CharacterOfNodes(const GltfAsset& asset, std::vector<int> nodes);

/// A character as one tree.
struct GltfSkeleton {
  std::vector<int> nodes;             ///< parents first, [0] the root
  std::vector<int> parents;           ///< indices into `nodes`, -1 for the root
  std::vector<Eigen::Affine3d> rest;  ///< of each node in the bind pose; upright where the file's
                                      ///< own pose is the bind pose, else in the mesh's axes
  std::vector<SourceMotion::EndSite> end_sites;  ///< childless nodes without mesh below a joint
  std::vector<std::string> notes;
};

/// Throws Error for more than 1000 joints.
GltfSkeleton BuildSkeleton(const GltfAsset& asset, const GltfCharacter& character);

/// The rotation within a linear map: its columns made orthonormal, x turned round where it mirrors.
/// Identity for maps that flatten space.
Eigen::Matrix3d RotationWithin(const Eigen::Matrix3d& linear);

}  // namespace holdfast
