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
  TriangleMesh mesh;  ///< all shapes; they may overlap
  std::optional<SignedDistance> distance;
  std::optional<DistanceGrid> grid;
  Eigen::Matrix3Xd samples;                          ///< surface points, a few millimeters apart
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of a bounding ball
  double radius = 0.0;

  bool Empty() const { return !grid; }
};

/// Solids of a hand for contact and collision, built once. Covers only palm and finger links, not
/// an arm.
class RobotSolids {
 public:
  RobotSolids(const RobotHand& hand, const RobotAnatomy& anatomy, int threads);

  const LinkSolid& Of(int link) const { return *solids_[static_cast<std::size_t>(link)]; }
  /// Links that have a shape.
  const std::vector<int>& Links() const { return links_; }
  /// Pairs of links that may collide: of two fingers, or the outer two phalanges of a finger and
  /// the palm; pairs that already intersect in the straight hand are excluded.
  const std::vector<std::pair<int, int>>& Pairs() const { return pairs_; }

 private:
  std::vector<std::shared_ptr<const LinkSolid>> solids_;  // shared by links of equal shape
  std::vector<int> links_;
  std::vector<std::pair<int, int>> pairs_;
};

/// A point of a robot's pad, in its link's frame.
struct PadPoint {
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outward unit normal
};

/// Contact surfaces of a robot hand by corresponding part of the human hand: for each link of a
/// part, the faces within 6 mm of its paired pad points with similar normals. Stored as surfaces,
/// for measuring, and as points 1.5 mm apart, for solvers.
class RobotPads {
 public:
  RobotPads() = default;
  RobotPads(const std::vector<SkinPair>& pairs, const RobotSolids& solids);

  bool Empty(int part) const { return patches_[static_cast<std::size_t>(part)].empty(); }

  /// Returns the surface point of a part, over all its links, that is nearest to `query` (object's
  /// frame); empty for a part without pad.
  std::optional<PadPoint> Nearest(int part, const PosedRobot& robot,
                                  const Eigen::Vector3d& query) const;

  /// Returns the point of the part that is nearest to the object, or deepest in it.
  std::optional<PadPoint> Touching(int part, const PosedRobot& robot,
                                   const DistanceGrid& object) const;

  /// Returns the point of the part that minimizes by_place |x - point|^2 + by_turn |m + normal|^2,
  /// with x its position and m its normal in the object's frame. `cost`: the minimum.
  std::optional<PadPoint> BestFacing(int part, const PosedRobot& robot,
                                     const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                     double by_place, double by_turn, double* cost) const;

 private:
  struct Patch {
    int link;
    TriangleMesh mesh;
    std::unique_ptr<TriangleTree> tree;
    // Position and normal of each point, one per row, so that a search is one product.
    Eigen::Matrix<double, Eigen::Dynamic, 6> points;
    Eigen::VectorXd squared_norms;  // of the positions
  };
  std::array<std::vector<Patch>, kNumHandParts> patches_;
};

}  // namespace holdfast
