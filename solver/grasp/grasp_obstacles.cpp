// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_obstacles.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace holdfast {
namespace {

// Vertices that do not move with these hands and forearms.
std::vector<int> AwayFromHands(const BodySurface& body, std::span<const Side> sides) {
  std::vector<int> vertices;
  for (int i = 0; i < body.NumVertices(); ++i) {
    double near = 0.0;
    for (const auto& [joint, weight] : body.Weights(i)) {
      for (const Side side : sides) {
        const bool finger = joint >= HandBegin(side) && joint < HandBegin(side) + kJointsPerHand;
        const bool elbow = joint == WristJoint(side) - 2;
        if (finger || joint == WristJoint(side) || elbow) near += weight;
      }
    }
    if (near < 0.2) vertices.push_back(i);
  }
  return vertices;
}

}  // namespace

std::vector<Eigen::Matrix3Xd> BodyAroundWrist(const Clip& clip, const BodySurface& body, Side side,
                                              double reach_m, int num_frames, bool other_hand) {
  const Side sides[] = {side, side == Side::kRight ? Side::kLeft : Side::kRight};
  const std::vector<int> vertices = AwayFromHands(body, std::span(sides, other_hand ? 1 : 2));
  const int wrist = WristJoint(side);
  const int count = std::min(num_frames, clip.NumFrames());
  std::vector<Eigen::Matrix3Xd> frames;
  BodyState state;
  for (int k = 0; k < count; ++k) {
    const int t = count == 1 ? 0 : k * (clip.NumFrames() - 1) / (count - 1);
    Forward(body, clip.pose[t], clip.trans.col(t), state);
    Eigen::Matrix3Xd points(3, vertices.size());
    Eigen::Index kept = 0;
    for (const int i : vertices) {
      const Eigen::Vector3d from_wrist = state.vertices.col(i) - state.joints.col(wrist);
      if (from_wrist.squaredNorm() > reach_m * reach_m) continue;
      points.col(kept++) = state.world_rotation[wrist].transpose() * from_wrist;
    }
    points.conservativeResize(3, kept);
    frames.push_back(std::move(points));
  }
  return frames;
}

WristObstacles::WristObstacles(std::span<const Eigen::Matrix3Xd> in_wrist) : sets_(in_wrist) {
  for (const Eigen::Matrix3Xd& points : sets_) {
    std::vector<int> ids(static_cast<std::size_t>(points.cols()));
    std::iota(ids.begin(), ids.end(), 0);
    patches_.emplace_back(points, std::move(ids));
  }
}

double WristObstacles::ShareBlocked(const DistanceGrid& object,
                                    const Eigen::Isometry3d& wrist_from_object) const {
  constexpr double kSoftTissue = 0.002;  // metres
  if (sets_.empty()) return 0.0;
  const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
  int blocked = 0;
  for (std::size_t k = 0; k < sets_.size(); ++k) {
    const auto distance = [&](int i) { return object.Linear(object_from_wrist * sets_[k].col(i)); };
    blocked += patches_[k].Least(distance, -kSoftTissue, -kSoftTissue) < -kSoftTissue;
  }
  return blocked / static_cast<double>(sets_.size());
}

}  // namespace holdfast
