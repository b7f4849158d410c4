// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solver/markers/marked_person.h"

namespace holdfast {

/// Shape of a person, marker positions, and poses of the calibration frames.
struct MarkerCalibration {
  Eigen::VectorXd betas;
  Eigen::Matrix3Xd places;             ///< (3 x M) in the frames of the markers' joints, meters
  std::vector<Eigen::VectorXd> roots;  ///< (6) per trial frame
  std::vector<Eigen::VectorXd> poses;  ///< q per trial frame
  int iterations = 0;
};

/// Standard deviation of a correctly placed marker; markers beyond the second count little.
constexpr double kMarkerResidual_m = 0.004, kMarkerRobust_m = 0.02;

/// First stage of MoSh (Loper, Mahmood, Black 2014): jointly solves shape, poses and marker
/// positions in frames of a static trial (may be empty) and of the trial, in temporal order. The
/// static trial has its own root; the trial has one root, or one per frame if pelvis or legs are
/// marked. The skin weights of the markers of `person` are recomputed (BlendAt) at the positions
/// found.
MarkerCalibration CalibrateMarkers(MarkedPerson& person,
                                   const std::vector<SeenMarkers>& static_frames,
                                   const std::vector<SeenMarkers>& trial_frames,
                                   double static_facing_rad, double trial_facing_rad);

/// Marker position relative to the skin in the T-pose: the nearest vertex, and the distance along
/// its normal (positive outside).
struct SkinPlace {
  int vertex = 0;
  double height_m = 0.0;
};
std::vector<SkinPlace> PlacesOnSkin(const MarkedPerson& person,
                                    const MarkerCalibration& calibration);

}  // namespace holdfast
