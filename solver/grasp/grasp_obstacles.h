// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/hand/point_patches.h"

namespace holdfast {

/// The body as the wrist sees it in up to `num_frames` frames spread over a clip: vertices within
/// `reach_m` of the wrist, in its frame, metres (3 x n, one set a frame), without the hand and
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
