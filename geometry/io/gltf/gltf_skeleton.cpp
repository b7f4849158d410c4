// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_skeleton.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kMaxJoints = 1000;
constexpr double kSamePose = std::numbers::pi / 180;  // between a file's pose and its bind pose

bool Invertible(const Eigen::Affine3d& transform) {
  const Eigen::Matrix4d matrix = transform.matrix();
  if (!matrix.allFinite()) return false;
  const Eigen::Vector3d sizes = transform.linear().colwise().norm();
  const double volume = sizes.prod();
  return volume > 1e-30 && volume < 1e30 &&
         std::abs(transform.linear().determinant()) > 1e-6 * volume;
}

void TakeBind(const GltfAsset& asset, const GltfSkin& skin, GltfCharacter& character) {
  if (skin.inverse_bind < 0) return;
  const GltfNumbers matrices(asset, skin.inverse_bind, 16);
  if (matrices.Count() < skin.joints.size()) {
    throw Error(asset.Where(),
                fmt::format("skin '{}' has {} inverse bind matrices for {} joints", skin.name,
                            matrices.Count(), skin.joints.size()),
                "Export the file again");
  }
  for (std::size_t k = 0; k < skin.joints.size(); ++k) {
    Eigen::Affine3d inverse = Eigen::Affine3d::Identity();
    for (int c = 0; c < 4; ++c) {
      for (int r = 0; r < 3; ++r) inverse(r, c) = matrices(k, 4 * c + r);
    }
    if (!inverse.matrix().allFinite()) {
      throw Error(asset.Where(),
                  fmt::format("the inverse bind matrix of {} is not finite",
                              asset.NodeText(skin.joints[k])),
                  "Export the file again");
    }
    // Some write zeros for joints without vertices: their place follows from the other joints.
    if (Invertible(inverse)) character.bind.try_emplace(skin.joints[k], inverse.inverse());
  }
}

std::string NameOf(const GltfAsset& asset, int skin) {
  const GltfSkin& own = asset.skins[skin];
  if (!own.name.empty()) return own.name;
  for (const GltfNode& node : asset.nodes) {
    if (node.skin == skin && !node.name.empty()) return node.name;
  }
  return asset.NodeAt(own.joints[0]).name;
}

// Number of the character's joints in the subtree of each node, itself included.
std::vector<int> CountJoints(const GltfAsset& asset, const std::vector<int>& joints) {
  std::vector<int> count(asset.nodes.size(), 0);
  for (const int joint : joints) count[joint] = 1;
  for (auto node = asset.order.rbegin(); node != asset.order.rend(); ++node) {
    const int parent = asset.NodeAt(*node).parent;
    if (parent >= 0) {
      count[parent] += count[static_cast<std::size_t>(*node)];
    }
  }
  return count;
}

// Rest transforms of all nodes: the bind pose if it is given, else relative to their neighbors as
// the file poses them.
std::vector<Eigen::Affine3d> RestOf(const GltfAsset& asset, const GltfCharacter& character,
                                    const GltfSkeleton& skeleton,
                                    const std::vector<Eigen::Affine3d>& posed) {
  const std::size_t n = skeleton.nodes.size();
  std::vector<std::optional<Eigen::Affine3d>> rest(n);
  for (std::size_t k = 0; k < n; ++k) {
    const auto found = character.bind.find(skeleton.nodes[k]);
    if (found != character.bind.end()) rest[k] = found->second;
  }
  for (std::size_t k = n; k-- > 1;) {
    const auto parent = static_cast<std::size_t>(skeleton.parents[k]);
    const Eigen::Affine3d local = asset.NodeAt(skeleton.nodes[k]).Local();
    if (rest[k] && !rest[parent] && Invertible(local)) rest[parent] = *rest[k] * local.inverse();
  }
  std::vector<Eigen::Affine3d> all(n);
  for (std::size_t k = 0; k < n; ++k) {
    all[k] = rest[k]  ? *rest[k]
             : k == 0 ? posed[0]
                      : all[skeleton.parents[k]] * asset.NodeAt(skeleton.nodes[k]).Local();
  }
  return all;
}

// If the file is in its bind pose, it also shows how the bind pose stands in the world.
void StandUpright(const std::vector<Eigen::Affine3d>& posed, std::vector<Eigen::Affine3d>& rest) {
  std::optional<Eigen::Matrix3d> world_from_bind;
  for (std::size_t k = 0; k < rest.size(); ++k) {
    const Eigen::Matrix3d turn =
        RotationWithin(posed[k].linear()) * RotationWithin(rest[k].linear()).transpose();
    if (!world_from_bind) world_from_bind = turn;
    if (AngleBetween(*world_from_bind, turn) > kSamePose) return;
  }
  for (Eigen::Affine3d& transform : rest) {
    transform = Eigen::Affine3d(Eigen::AngleAxisd(*world_from_bind)) * transform;
  }
}

}  // namespace

Eigen::Matrix3d RotationWithin(const Eigen::Matrix3d& linear) {
  Eigen::Matrix3d R = linear;
  if (linear.determinant() < 0) R.col(0) = -R.col(0);
  for (int c = 0; c < 3; ++c) {
    for (int before = 0; before < c; ++before) {
      R.col(c) -= R.col(before).dot(R.col(c)) * R.col(before);
    }
    const double size = R.col(c).norm();
    if (!(size > 1e-12) || !std::isfinite(size)) return Eigen::Matrix3d::Identity();
    R.col(c) /= size;
  }
  return R;
}

std::vector<GltfCharacter> FindCharacters(const GltfAsset& asset) {
  const auto count = static_cast<int>(asset.skins.size());
  DisjointSets groups(count);
  // The skin of which a node is a joint, or below whose joint it is.
  std::vector<int> owner(asset.nodes.size(), -1);
  for (int s = 0; s < count; ++s) {
    for (const int joint : asset.skins[s].joints) {
      int& known = owner[joint];
      if (known >= 0) groups.Merge(known, s);
      known = s;
    }
  }
  for (const int node : asset.order) {
    const int parent = asset.NodeAt(node).parent;
    const int above = parent >= 0 ? owner[parent] : -1;
    int& own = owner[node];
    if (above < 0) continue;
    if (own >= 0) {
      groups.Merge(above, own);
    } else {
      own = above;
    }
  }
  std::map<int, GltfCharacter> characters;
  for (int s = 0; s < count; ++s) {
    const GltfSkin& skin = asset.skins[s];
    GltfCharacter& character = characters[groups.Find(s)];
    if (character.joints.empty()) character.name = NameOf(asset, s);
    character.joints.insert(character.joints.end(), skin.joints.begin(), skin.joints.end());
    TakeBind(asset, skin, character);
  }
  std::vector<GltfCharacter> result;
  for (auto& [first_skin, character] : characters) {
    std::sort(character.joints.begin(), character.joints.end());
    character.joints.erase(std::unique(character.joints.begin(), character.joints.end()),
                           character.joints.end());
    result.push_back(std::move(character));
  }
  return result;
}

GltfCharacter CharacterOfNodes(const GltfAsset& asset, std::vector<int> nodes) {
  GltfCharacter character;
  std::sort(nodes.begin(), nodes.end());
  character.joints = std::move(nodes);
  if (!character.joints.empty()) character.name = asset.NodeAt(character.joints[0]).name;
  return character;
}

GltfSkeleton BuildSkeleton(const GltfAsset& asset, const GltfCharacter& character) {
  GltfSkeleton skeleton;
  const std::vector<int> count = CountJoints(asset, character.joints);
  const auto joints_below = [&](int node) { return count[node]; };
  // The tree with the most joints, then the deepest node that is above all of them.
  int root = -1;
  for (const int node : asset.order) {
    if (asset.NodeAt(node).parent >= 0) break;
    if (root < 0 || joints_below(node) > joints_below(root)) root = node;
  }
  const int total = root < 0 ? 0 : joints_below(root);
  if (total == 0) {
    throw Error(asset.Where(), "holds no joints", "Export the character with its skeleton");
  }
  if (total < static_cast<int>(character.joints.size())) {
    skeleton.notes.push_back(
        fmt::format("{} joints of '{}' are in other trees of the scene and are ignored",
                    character.joints.size() - static_cast<std::size_t>(total), character.name));
  }
  for (bool deeper = true; deeper;) {
    deeper = false;
    if (std::binary_search(character.joints.begin(), character.joints.end(), root)) break;
    for (const int child : asset.NodeAt(root).children) {
      if (joints_below(child) != total) continue;
      root = child;
      deeper = true;
      break;
    }
  }

  Eigen::Affine3d above = Eigen::Affine3d::Identity();
  for (int node = asset.NodeAt(root).parent; node >= 0; node = asset.NodeAt(node).parent) {
    above = asset.NodeAt(node).Local() * above;
  }
  std::vector<Eigen::Affine3d> posed;
  skeleton.nodes.push_back(root);
  skeleton.parents.push_back(-1);
  std::vector<std::pair<std::size_t, int>> tips;
  for (std::size_t k = 0; k < skeleton.nodes.size(); ++k) {
    const GltfNode& node = asset.NodeAt(skeleton.nodes[k]);
    posed.push_back((k == 0 ? above : posed[skeleton.parents[k]]) * node.Local());
    for (const int child : node.children) {
      const GltfNode& below = asset.NodeAt(child);
      if (joints_below(child) > 0) {
        skeleton.nodes.push_back(child);
        skeleton.parents.push_back(static_cast<int>(k));
      } else if (below.children.empty() && below.mesh < 0) {
        tips.emplace_back(k, child);
      }
    }
    if (skeleton.nodes.size() > kMaxJoints) {
      throw Error(asset.Where(),
                  fmt::format("'{}' has more than {} joints", character.name, kMaxJoints),
                  "Export one character with the skeleton of its body");
    }
  }
  skeleton.rest = RestOf(asset, character, skeleton, posed);
  StandUpright(posed, skeleton.rest);
  for (const auto& [joint, node] : tips) {
    const Eigen::Vector3d offset = skeleton.rest[joint].linear() * asset.NodeAt(node).translation;
    skeleton.end_sites.push_back({static_cast<int>(joint), offset});
  }
  return skeleton;
}

}  // namespace holdfast
