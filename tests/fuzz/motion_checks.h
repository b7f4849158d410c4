// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "geometry/io/motion/motion_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace holdfast::fuzz {

/// What every reader of motions promises of a motion it returns (geometry/io/motion/motion_file.h).
inline void RequireSound(const SourceMotion& motion) {
  const int joints = motion.NumJoints();
  const int frames = motion.NumFrames();
  Require(joints > 0 && frames > 0, "a motion has joints and frames");
  Require(motion.parents.size() == motion.joint_names.size(), "one parent per joint");
  Require(motion.rest_offsets.cols() == joints, "one offset per joint");
  Require(motion.rotations.size() == motion.joint_names.size() * motion.positions.size(),
          "one rotation per joint and frame");
  Require(motion.parents[0] == -1, "joint 0 is the root");
  for (int j = 1; j < joints; ++j) {
    Require(motion.parents[j] >= 0 && motion.parents[j] < j, "parents come before children");
  }
  for (const SourceMotion::EndSite& site : motion.end_sites) {
    Require(site.parent >= 0 && site.parent < joints, "end sites hang on joints");
    Require(site.offset.allFinite(), "end sites are finite");
  }
  Require(std::isfinite(motion.frame_rate) && motion.frame_rate > 0, "a positive frame rate");
  Require(motion.rest_offsets.allFinite(), "offsets are finite");
  for (const Eigen::Matrix3Xd& position : motion.positions) {
    Require(position.cols() == joints, "one position per joint");
    Require(position.allFinite(), "positions are finite");
  }
  for (const Eigen::Quaterniond& rotation : motion.rotations) {
    Require(std::abs(rotation.norm() - 1) < 1e-6, "rotations have unit length");
  }
}

}  // namespace holdfast::fuzz
