// SPDX-License-Identifier: MIT
#include "solver/carry/palms.h"

#include <algorithm>
#include <cmath>

#include "generator/body/limb_ik.h"
#include "geometry/body/body_model.h"

namespace holdfast {

Eigen::Vector3d PalmOf(Side side, const Eigen::Isometry3d& wrist) {
  constexpr double kFromWrist_m = 0.08;
  return wrist.translation() + kFromWrist_m * FingerDirection(side, wrist.linear());
}

Eigen::VectorXd PalmTracks::Speed(Side side) const {
  const Eigen::Matrix3Xd& palm = Of(side);
  const auto half = std::max<Eigen::Index>(1, std::lround(0.04 * frame_rate));
  Eigen::VectorXd speed(palm.cols());
  for (Eigen::Index t = 0; t < palm.cols(); ++t) {
    const Eigen::Index from = std::max<Eigen::Index>(0, t - half);
    const Eigen::Index to = std::min(palm.cols() - 1, t + half);
    const double frames = static_cast<double>(std::max<Eigen::Index>(1, to - from));
    speed(t) = frame_rate * (palm.col(to) - palm.col(from)).norm() / frames;
  }
  return speed;
}

PalmTracks TrackPalms(const Clip& clip, const Eigen::Matrix3Xd& rest_joints) {
  PalmTracks tracks;
  tracks.frame_rate = clip.frame_rate;
  for (Eigen::Matrix3Xd& palm : tracks.at) palm.resize(3, clip.NumFrames());
  Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest_joints, clip.pose[static_cast<std::size_t>(t)], clip.trans.col(t), state);
    tracks.at[0].col(t) = PalmOf(Side::kRight, state.WorldFromJoint(kRightWrist));
    tracks.at[1].col(t) = PalmOf(Side::kLeft, state.WorldFromJoint(kLeftWrist));
    tracks.head.push_back(state.WorldFromJoint(kHead));
    forward += state.world_rotation[kSpine3].col(2);
  }
  forward.z() = 0.0;
  if (!forward.isZero()) tracks.forward = forward.normalized();
  return tracks;
}

}  // namespace holdfast
