// SPDX-License-Identifier: MIT
#pragma once

#include "generator/matching/body_frame.h"
#include "generator/wandr/pose.h"

namespace holdfast {

/// A network's pose as a frame of the same body; `rest_pelvis` is J_0.
inline BodyFrame FrameOf(const wandr::Pose<double>& pose, const Eigen::Vector3d& rest_pelvis) {
  BodyFrame frame;
  frame.pelvis = pose.translation + rest_pelvis;
  for (std::size_t k = 0; k < kNumBodyJoints; ++k) {
    frame.local[k] = Eigen::Quaterniond(pose.rotation[k]);
  }
  return frame;
}

/// The same the other way round.
inline wandr::Pose<double> PoseOf(const BodyFrame& frame, const Eigen::Vector3d& rest_pelvis) {
  wandr::Pose<double> pose;
  pose.translation = frame.pelvis - rest_pelvis;
  for (std::size_t k = 0; k < kNumBodyJoints; ++k) {
    pose.rotation[k] = frame.local[k].toRotationMatrix();
  }
  return pose;
}

}  // namespace holdfast
