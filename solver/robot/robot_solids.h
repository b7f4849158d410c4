// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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
#include "geometry/robot/robot_hand.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/robot/hand_correspondence.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

/// Number of consecutive points that are close together in the result of InBlocks.
inline constexpr int kSampleBlock = 16;

/// Returns the points reordered into spatially compact blocks of kSampleBlock.
Eigen::Matrix3Xd InBlocks(const Eigen::Matrix3Xd& points);

/// Caches which points of a set may be near a solid while their relative motion is small: a point
/// at distance d that moved by m is at least d - m away. Solvers move a hand by millimeters, and
/// few points of a link are near anything. Scratch object for one set and one solid.
class NearSamples {
 public:
  /// Margin around a solid's ball within which points are considered until the next update.
  static constexpr double kAround_m = 0.012;

  /// Calls visit(index, position in the solid's frame), in order, for all points of the set that
  /// may be closer than `reach` (meters, up to a few millimeters) to the solid, and for some
  /// others. `points` (ordered by InBlocks) are in their own frame; `center` and `radius` are of a
  /// ball around either all of them or the solid's current position plus kAround_m, whichever is
  /// smaller.
  template <typename Visit>
  void ForNear(const Eigen::Matrix3Xd& points, const Eigen::Vector3d& center, double radius,
               const DistanceGrid& solid, const Eigen::Isometry3d& solid_from_points, double reach,
               const Visit& visit) {
    double moved = Moved(solid_from_points);
    if (!(moved < kFarthest_m)) {
      center_ = center;
      radius_ = radius + 1e-6;  // rounding
      Begin(points, solid, solid_from_points, reach);
      moved = 0.0;
    }
    const double most = reach + kSlack_m + kSlope * moved;
    for (const auto& [distance, index] : near_) {
      if (distance > most) continue;
      visit(index, Eigen::Vector3d(solid_from_points * points.col(index)));
    }
  }

 private:
  // An interpolated distance changes slightly faster than the displacement.
  static constexpr double kFarthest_m = 0.005, kSlack_m = 5e-4, kSlope = 1.5;

  // Bound on the displacement of the ball's points since Begin. Points outside the ball approach
  // the solid's center by at most this: rotation about it does not bring them nearer.
  double Moved(const Eigen::Isometry3d& now) const {
    if (!begun_) return std::numeric_limits<double>::infinity();
    return (now * center_ - then_ * center_).norm() +
           radius_ * (now.linear() - then_.linear()).norm();
  }

  void Begin(const Eigen::Matrix3Xd& points, const DistanceGrid& solid,
             const Eigen::Isometry3d& solid_from_points, double reach) {
    begun_ = true;
    then_ = solid_from_points;
    near_.clear();
    const double most = reach + kSlack_m + kSlope * kFarthest_m;
    // Distance from the solid of anything within `around` of a point; infinity if too far.
    const auto distance = [&](const Eigen::Vector3d& point, double around) {
      constexpr double kFar = std::numeric_limits<double>::infinity();
      if ((point - center_).norm() > radius_ + around) return kFar;
      const Eigen::Vector3d x = then_ * point;
      if (((solid.Min() - x).array().max((x - solid.Max()).array()) > most + around).any()) {
        return kFar;
      }
      const double there = solid.Linear(x);
      return there > most + around ? kFar : there;
    };
    const int count = static_cast<int>(points.cols());
    if (balls_.cols() == 0) balls_ = BallsAround(points);
    for (int block = 0; block < static_cast<int>(balls_.cols()); ++block) {
      if (std::isinf(distance(balls_.col(block).head<3>(), balls_(3, block)))) continue;
      const int end = std::min((block + 1) * kSampleBlock, count);
      for (int k = block * kSampleBlock; k < end; ++k) {
        const double near = distance(points.col(k), 0.0);
        if (!std::isinf(near)) near_.emplace_back(near, k);
      }
    }
  }

  // Center and radius of each block.
  static Eigen::Matrix4Xd BallsAround(const Eigen::Matrix3Xd& points);

  bool begun_ = false;
  Eigen::Isometry3d then_ = Eigen::Isometry3d::Identity();
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();  // of the set's ball at `then_`
  double radius_ = 0.0;
  Eigen::Matrix4Xd balls_;                    // BallsAround of the set
  std::vector<std::pair<double, int>> near_;  // distances at `then_`
};

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

  const LinkSolid& Of(int link) const { return *solids_[link]; }
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
  /// `whole_fingers`: the pads of a finger serve all of its parts.
  RobotPads(const std::vector<SkinPair>& pairs, const RobotSolids& solids,
            bool whole_fingers = false);

  bool Empty(int part) const { return patches_[part].empty(); }

  /// Returns the surface point of a part, over all its links, that is nearest to `query` (object's
  /// frame); empty for a part without pad.
  std::optional<PadPoint> Nearest(int part, const PosedRobot& robot,
                                  const Eigen::Vector3d& query) const;

  /// Returns the point of the part that is nearest to the object, or deepest in it; empty if all
  /// are `most_m` away or more.
  std::optional<PadPoint> Touching(int part, const PosedRobot& robot, const DistanceGrid& object,
                                   double most_m = std::numeric_limits<double>::infinity()) const;

  /// Returns the middle of a part's pad: the point nearest to the mean of its points.
  std::optional<PadPoint> Middle(int part, const PosedRobot& robot) const;

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
    Eigen::Vector3d center;         // of a ball around them
    double radius;
  };
  std::array<std::vector<std::shared_ptr<const Patch>>, kNumHandParts> patches_;
};

}  // namespace holdfast
