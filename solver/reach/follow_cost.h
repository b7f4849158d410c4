// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>

#include "generator/wandr/body_kinematics.h"
#include "generator/wandr/heading.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// What one frame of a candidate's motion costs, in about metres: the right wrist away from the
/// goal, the pelvis nearer than 0.3 m or farther than 0.5 m, facing another way, no foot that
/// carries (the better of both: its slide and height), soles in the ground, trunk tilted by more
/// than 20 degrees, pelvis faster than 1.7 m/s.
class FollowCost {
 public:
  explicit FollowCost(const wandr::BoneOffsets<float>& bones, float sole_z) : bones_(bones) {
    // Heights of ankles and balls of who stands.
    wandr::Pose<float> rest;
    wandr::BodyKinematics<float> placed;
    wandr::ForwardKinematics(bones, rest, placed);
    for (std::size_t k = 0; k < kFeet.size(); ++k) stands_[k] = placed.joints(1, kFeet[k]) - sole_z;
  }

  void Place(const wandr::Pose<float>& pose, wandr::BodyKinematics<float>& out) const {
    wandr::ForwardKinematics(bones_, pose, out);
  }

  float operator()(const wandr::BodyKinematics<float>& before,
                   const wandr::BodyKinematics<float>& now, const Eigen::Vector3f& goal) const {
    const auto& joints = now.joints;
    const Eigen::Vector3f pelvis = joints.col(kPelvis), way = goal - pelvis;
    const float away = way.head<2>().norm();
    float cost = std::sqrt((joints.col(kRightWrist) - goal).squaredNorm() + 0.0025f);
    cost += std::max(0.0f, away - 0.5f) + std::max(0.0f, 0.3f - away);
    const Eigen::Vector3f forward = wandr::HeadingOf<float>(now.world[0]).Forward();
    if (away > 0.2f) cost += 0.15f * (1.0f - forward.head<2>().dot(way.head<2>()) / away);
    // One foot carries.
    float carries = 10.0f;
    for (const int foot : {0, 1}) {
      float moves = 0.0f, high = 1.0f;
      for (const int k : {foot, foot + 2}) {
        const int joint = kFeet[k];
        const float height = joints(2, joint) - stands_[k];
        cost += 3.0f * std::max(0.0f, -height - 0.02f);
        high = std::min(high, std::max(0.0f, height - 0.02f));
        moves += 0.5f * 30.0f * (joints.col(joint) - before.joints.col(joint)).head<2>().norm();
      }
      carries = std::min(carries, moves + 10.0f * high);
    }
    cost += 0.1f * carries;
    const Eigen::Vector3f trunk = (joints.col(kNeck) - pelvis).normalized();
    cost += std::max(0.0f, 0.94f - trunk.z()) * (goal.z() < 0.8f ? 0.2f : 1.0f);
    cost += 0.3f * std::max(0.0f, 30.0f * (pelvis - before.joints.col(0)).norm() - 1.7f);
    return cost;
  }

 private:
  static constexpr std::array<int, 4> kFeet = {kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot};
  wandr::BoneOffsets<float> bones_;
  std::array<float, 4> stands_ = {};
};

}  // namespace holdfast
