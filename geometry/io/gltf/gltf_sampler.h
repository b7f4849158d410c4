// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/io/gltf/asset/gltf_asset.h"

namespace holdfast {

/// One animation of a glTF file, evaluated at any time: nodes that it does not move stay as the
/// file poses them. Before its first key a property has the first value, after the last the last.
class GltfSampler {
 public:
  /// Throws Error for times that are not finite or not in order, values that are not finite,
  /// quaternions without direction, key counts that disagree, and properties moved twice.
  GltfSampler(const GltfAsset& asset, const GltfAnimation& animation);

  bool Moves(int node) const { return tracks_.contains(node); }
  /// Whether it turns or shifts the node, scaling apart.
  bool MovesRigidly(int node) const;
  double Begin() const { return begin_; }  ///< seconds, first key of all
  double End() const { return end_; }

  /// Transform of a node relative to its parent, at a time within `snap` of a key as at that key.
  Eigen::Affine3d Local(int node, double time, double snap) const;

  /// The frames per second of the keys: `told` where the keys agree with it, else what lies between
  /// all of them; `regular` is false when they lie on no common rate.
  double FrameRate(double told, bool& regular) const;

 private:
  struct Track {
    GltfNumbers times, values;
    GltfInterpolation interpolation;
  };
  struct Tracks {
    std::optional<Track> translation, rotation, scale;
  };

  void CheckTimes(int accessor, const GltfNumbers& times);
  void CheckValues(const GltfChannel& channel, const GltfNumbers& values, std::size_t keys);
  bool KeysFit(double rate, double off_grid) const;
  template <int kRows>
  static Eigen::Matrix<double, kRows, 1> Evaluate(const Track& track, double time, double snap);

  const GltfAsset* asset_;
  std::map<int, Tracks> tracks_;       // by node
  std::map<int, GltfNumbers> inputs_;  // by accessor: times that are in order
  std::map<std::array<int, 3>, bool> checked_;
  double begin_ = 0, end_ = 0;
};

}  // namespace holdfast
