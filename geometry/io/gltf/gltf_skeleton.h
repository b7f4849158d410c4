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

/// Joints that belong together: those of all skins that share a joint or are nested in one another.
struct GltfCharacter {
  std::string name;                     ///< name of its skin, its mesh or its topmost joint
  std::vector<int> joints;              ///< nodes, ascending
  std::map<int, Eigen::Affine3d> bind;  ///< joint to mesh at rest, if the file has it
};

/// Finds the characters of a file by its skins, in file order. Throws Error for inverse bind
/// matrices that are missing for some joints or not finite.
std::vector<GltfCharacter> FindCharacters(const GltfAsset& asset);

/// Makes a character of animated nodes without any skin ("animation only" exports).
GltfCharacter CharacterOfNodes(const GltfAsset& asset, std::vector<int> nodes);

/// A character as a single tree.
struct GltfSkeleton {
  std::vector<int> nodes;             ///< parents first, [0] the root
  std::vector<int> parents;           ///< indices into `nodes`, -1 for the root
  std::vector<Eigen::Affine3d> rest;  ///< of each node in the bind pose; upright if the file's own
                                      ///< pose is the bind pose, else in the mesh's axes
  std::vector<SourceMotion::EndSite> end_sites;  ///< childless nodes without mesh below a joint
  std::vector<std::string> notes;
};

/// Throws Error for more than 1000 joints.
GltfSkeleton BuildSkeleton(const GltfAsset& asset, const GltfCharacter& character);

/// Rotation part of a linear map: its columns made orthonormal, x reversed if the map mirrors.
/// Identity for maps that flatten space.
Eigen::Matrix3d RotationWithin(const Eigen::Matrix3d& linear);

}  // namespace holdfast
