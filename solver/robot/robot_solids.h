// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/mesh/triangle_tree.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/robot/hand_correspondence.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot/robot_term.h"
#include "solver/robot_hand/robot_hand.h"

namespace holdfast {

/// A link as a solid, in its own frame.
struct LinkSolid {
  TriangleMesh mesh;  ///< all its shapes; they may overlap
  std::optional<SignedDistance> distance;
  std::optional<DistanceGrid> grid;
  Eigen::Matrix3Xd samples;                          ///< of its surface, a few millimeters apart
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of a ball around it
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

/// A place of a robot's pad, in its link's frame.
struct PadPoint {
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outwards, unit
};

/// The touching surfaces of a robot's hand, by part of the human hand that they stand for: of each
/// link of a part, the faces within 6 mm of its pads' paired points that face as these do. As
/// surfaces, for measuring, and as points 1.5 mm apart, for solvers.
class RobotPads {
 public:
  RobotPads() = default;
  RobotPads(const std::vector<SkinPair>& pairs, const RobotSolids& solids);

  bool Empty(int part) const { return patches_[static_cast<std::size_t>(part)].empty(); }

  /// The point of the part's surface that is nearest to `query` (object's frame), of all its links;
  /// nothing for a part without pad.
  std::optional<PadPoint> Nearest(int part, const PosedRobot& robot,
                                  const Eigen::Vector3d& query) const;

  /// Of the part's points, the one that is nearest to the object, or deepest in it.
  std::optional<PadPoint> Touching(int part, const PosedRobot& robot,
                                   const DistanceGrid& object) const;

  /// Of the part's points, the one of least by_place |x - point|^2 + by_turn |m + normal|^2, x its
  /// place and m its normal in the object's frame. `cost`: that least value.
  std::optional<PadPoint> BestFacing(int part, const PosedRobot& robot,
                                     const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                     double by_place, double by_turn, double* cost) const;

 private:
  struct Patch {
    int link;
    TriangleMesh mesh;
    std::unique_ptr<TriangleTree> tree;
    // Of the points: place and normal, a row each, so that a search is one product.
    Eigen::Matrix<double, Eigen::Dynamic, 6> points;
    Eigen::VectorXd squared_norms;  // of the places
  };
  std::array<std::vector<Patch>, kNumHandParts> patches_;
};

}  // namespace holdfast
