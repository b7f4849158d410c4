// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <map>
#include <set>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/io/gltf/asset/gltf_asset.h"

namespace holdfast {

/// One animation of a glTF file, evaluated at any time. Nodes that it does not move keep the file's
/// pose. Before its first key and after its last, a property keeps that key's value.
class GltfSampler {
 public:
  /// Throws Error for times that are not finite or not in order, values that are not finite,
  /// quaternions without direction, inconsistent key counts, and properties moved twice.
  GltfSampler(const GltfAsset& asset, const GltfAnimation& animation);

  /// Whether the animation rotates or translates the node; scaling does not count.
  bool MovesRigidly(int node) const;
  double Begin() const { return begin_; }  ///< seconds, first key of all properties
  double End() const { return end_; }

  /// Transform of a node relative to its parent; a time within `snap` of a key counts as that key.
  Eigen::Affine3d Local(int node, double time, double snap) const;

  /// Frame rate of the keys: `told` if the keys agree with it, else by their spacing; `regular` is
  /// false if the keys fit no common rate.
  double FrameRate(double told, bool& regular) const;

 private:
  struct Track {
    GltfNumbers times, values;
    GltfInterpolation interpolation;
  };

  void CheckTimes(int accessor, const GltfNumbers& times);
  void CheckValues(const GltfChannel& channel, const GltfNumbers& values, std::size_t keys);
  bool KeysFit(double rate, double off_grid) const;
  template <int kRows>
  static Eigen::Matrix<double, kRows, 1> Evaluate(const Track& track, double time, double snap);

  const GltfAsset* asset_;
  std::map<std::pair<int, GltfPath>, Track> tracks_;  // by node and property
  std::map<int, GltfNumbers> inputs_;                 // by accessor: times that are in order
  std::set<std::array<int, 3>> checked_;
  double begin_ = 0, end_ = 0;
};

}  // namespace holdfast
