// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot_hand/robot_hand.h"

namespace holdfast {

/// A link as a solid, in its own frame.
struct LinkSolid {
  TriangleMesh mesh;  ///< all its shapes; they may overlap
  std::optional<SignedDistance> distance;
  std::optional<DistanceGrid> grid;
  Eigen::Matrix3Xd samples;                          ///< of its surface, a few millimetres apart
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of a ball around it
  double radius = 0.0;

  bool Empty() const { return !grid; }
};

/// What of a hand can touch and be touched, made once. Links of a palm and of fingers only: an arm
/// is none of it.
class RobotSolids {
 public:
  RobotSolids(const RobotHand& hand, const RobotAnatomy& anatomy, int threads);

  const LinkSolid& Of(int link) const { return *solids_[static_cast<std::size_t>(link)]; }
  /// Links that have a shape.
  const std::vector<int>& Links() const { return links_; }
  /// Pairs of links that could meet: of two fingers, or a finger's outer two phalanges and the
  /// palm; not those that meet when the hand is straight.
  const std::vector<std::pair<int, int>>& Pairs() const { return pairs_; }

 private:
  std::vector<std::shared_ptr<const LinkSolid>> solids_;  // links of one shape share theirs
  std::vector<int> links_;
  std::vector<std::pair<int, int>> pairs_;
};

}  // namespace holdfast
