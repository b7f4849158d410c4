// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/triangle_tree.h"
#include "solver/grasp/grasp_candidates.h"
#include "solver/hand/hand_evaluation.h"

namespace holdfast {

/// Where on an object a hand is to take hold: on a part of its surface, near a point, or both.
/// Const and shared by threads.
class GraspPlace {
 public:
  /// What is asked for, in the object's own frame, meters.
  struct Wanted {
    TriangleMesh region;  ///< contacts belong on this part of the surface; empty: on all of it
    TriangleMesh avoid;   ///< and not on this part
    std::optional<Eigen::Vector3d> at;  ///< on both sides of what is at this point
    /// Widest that is held there: of one hand, or between both.
    double span_m = OppositionOptions{}.max_width_m;
  };
  static constexpr double kFarthestOff_m = 0.03;  ///< of `at` from the surface
  static constexpr double kReach_m = 0.05;  ///< of the middle of the contacts from the middle there
  static constexpr double kMaxOutside = 0.1;  ///< share of contacts that may be elsewhere

  /// Throws Error for a region that is no part of the object or has nothing left, and for a point
  /// farther than `kFarthestOff_m` from the surface.
  GraspPlace(const TriangleMesh& object, const Wanted& wanted);

  /// Whether a point of the surface (or near it) is in the region.
  bool InRegion(const Eigen::Vector3d& point) const;
  /// And near enough to `at`.
  bool Allows(const Eigen::Vector3d& point) const;

  /// The faces of the region, with all vertices of the object.
  const TriangleMesh& Surface() const { return surface_; }
  const std::optional<Eigen::Vector3d>& At() const { return at_; }
  /// The middle of what is at `at`, else of the region.
  const Eigen::Vector3d& Center() const { return center_; }

 private:
  TriangleTree tree_;          // of the whole object
  std::vector<bool> allowed_;  // per face
  TriangleMesh surface_;
  std::optional<Eigen::Vector3d> at_;
  Eigen::Vector3d center_;
  double reach_ = 0.0;  // of contacts from it
};

/// The body as the wrist sees it in up to `num_frames` frames spread over a clip: vertices within
/// `reach_m` of the wrist, in its frame, meters (3 x n, one set a frame), without the hand and
/// forearm of `side` themselves, and without the other hand's where that hand is to touch the
/// object too. For GraspOptions::obstacles_in_wrist: an object that is carried through the clip
/// should not go through a leg on its way.
std::vector<Eigen::Matrix3Xd> BodyAroundWrist(const Clip& clip, const BodySurface& body, Side side,
                                              double reach_m, int num_frames = 8,
                                              bool other_hand = true);

/// Sets of such points in patches, for many poses of one object. Const, shared by threads.
class WristObstacles {
 public:
  /// `in_wrist` must outlive this.
  explicit WristObstacles(std::span<const Eigen::Matrix3Xd> in_wrist);

  /// Share of the sets with a point deeper in the held object than soft tissue gives; 0 without
  /// any.
  double ShareBlocked(const DistanceGrid& object, const Eigen::Isometry3d& wrist_from_object) const;

 private:
  std::span<const Eigen::Matrix3Xd> sets_;
  std::vector<PointPatches> patches_;  // of each
};

}  // namespace holdfast
