// SPDX-License-Identifier: MIT
#include "solver/grasp_obstacles.h"

#include <algorithm>

namespace holdfast {
namespace {

// Vertices that move with the upper arm, trunk, head, legs and the other arm.
std::vector<int> AwayFromHand(const BodySurface& body, Side side) {
  const int elbow = WristJoint(side) - 2;
  std::vector<int> vertices;
  for (int i = 0; i < body.NumVertices(); ++i) {
    double near = 0.0;
    for (const auto& [joint, weight] : body.Weights(i)) {
      const bool finger = joint >= HandBegin(side) && joint < HandBegin(side) + kJointsPerHand;
      if (finger || joint == WristJoint(side) || joint == elbow) near += weight;
    }
    if (near < 0.2) vertices.push_back(i);
  }
  return vertices;
}

}  // namespace

std::vector<Eigen::Matrix3Xd> BodyAroundWrist(const Clip& clip, const BodySurface& body, Side side,
                                              double reach_m, int num_frames) {
  const std::vector<int> vertices = AwayFromHand(body, side);
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

}  // namespace holdfast
