// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solver/markers/marked_person.h"

namespace holdfast {

/// A person's shape, where each marker sits, and the poses of the frames that told it.
struct MarkerCalibration {
  Eigen::VectorXd betas;
  Eigen::Matrix3Xd places;             ///< (3 x M) in the frames of the joints followed, meters
  std::vector<Eigen::VectorXd> roots;  ///< (6) of each trial frame given
  std::vector<Eigen::VectorXd> poses;  ///< q of each
  int iterations = 0;
};

struct MarkerScales {
  double residual_m = 0.004;  ///< one standard deviation of a marker that sits where it should
  double robust_m = 0.02;     ///< beyond which a marker counts little
};

/// The first stage of MoSh (Loper, Mahmood, Black 2014): shape, poses and places of markers
/// together, in frames of a static trial (may be empty) and of the trial itself, in order of time.
/// The static trial has a root of its own; the trial one, or one a frame where pelvis or legs are
/// marked. Of the person, what skin its markers move with is taken anew (BlendAt) where they are
/// found.
MarkerCalibration CalibrateMarkers(MarkedPerson& person,
                                   const std::vector<SeenMarkers>& static_frames,
                                   const std::vector<SeenMarkers>& trial_frames,
                                   double static_facing_rad, double trial_facing_rad,
                                   const MarkerScales& scales);

/// Where a marker's place is against the skin in the T-pose: the triangle's nearest vertex, and the
/// distance along the normal (positive outside).
struct SkinPlace {
  int vertex = 0;
  double height_m = 0.0;
};
std::vector<SkinPlace> PlacesOnSkin(const MarkedPerson& person,
                                    const MarkerCalibration& calibration);

}  // namespace holdfast
