// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/joint_error.h"

#include <algorithm>
#include <limits>

#include "geometry/error.h"

namespace holdfast {
namespace {

// Mean distance after both point sets are translated so that their first points coincide.
template <typename Points>
double AlignedError_mm(const Points& a, const Points& b) {
  const Eigen::Vector3d shift = b.col(0) - a.col(0);
  return 1e3 * ((a.colwise() + shift) - b).colwise().norm().mean();
}

}  // namespace

std::array<int, 5> FingertipVertices(const BodyModel& model, Side side) {
  // Skinning weights belong to a surface, so one of this hand is built, without shape.
  const std::vector<int>& ids = model.HandVertexIds(side);
  const std::shared_ptr<const BodyModel> unowned(std::shared_ptr<void>(), &model);
  const BodySurface hand(unowned, {}, ids);
  std::array<int, 5> tips;
  for (int finger = 0; finger < 5; ++finger) {
    const int last = HandBegin(side) + 3 * finger + 2;
    const Eigen::Vector3d at = hand.RestJoints().col(last);
    const Eigen::Vector3d along = at - hand.RestJoints().col(last - 1);
    double farthest = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < hand.NumVertices(); ++i) {
      const auto weights = hand.Weights(i);
      const auto most = std::max_element(weights.begin(), weights.end(),
                                         [](auto& a, auto& b) { return a.second < b.second; });
      if (most == weights.end() || most->first != last) continue;
      const double reach = along.dot(hand.RestVertices().col(i) - at);
      if (reach <= farthest) continue;
      farthest = reach;
      tips[finger] = ids[i];
    }
    if (!(farthest > 0.0)) {
      throw Error(model.Name(), "has no vertex on a finger's last phalanx",
                  "Give a body model with hands");
    }
  }
  return tips;
}

std::vector<BodyPoints> BodyTrajectory(const Clip& clip,
                                       const std::shared_ptr<const BodyModel>& model,
                                       const Eigen::VectorXd& betas) {
  std::vector<int> tips;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    for (const int vertex : FingertipVertices(*model, side)) tips.push_back(vertex);
  }
  const BodySurface surface(model, betas, tips);
  std::vector<BodyPoints> frames(static_cast<std::size_t>(clip.NumFrames()));
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    BodyPoints& points = frames[t];
    points.joints = state.joints.leftCols<kNumBodyJoints>();
    for (const Side side : {Side::kRight, Side::kLeft}) {
      HandPoints& hand = side == Side::kRight ? points.right : points.left;
      hand << state.joints.col(WristJoint(side)),
          state.joints.middleCols<kJointsPerHand>(HandBegin(side)),
          state.vertices.middleCols<5>(side == Side::kRight ? 0 : 5);
    }
  }
  return frames;
}

JointError CompareJoints(const BodyPoints& points, const BodyPoints& reference) {
  JointError error;
  error.global = 1e3 * (points.joints - reference.joints).colwise().norm().mean();
  error.root_aligned = AlignedError_mm(points.joints, reference.joints);
  error.right_hand = AlignedError_mm(points.right, reference.right);
  error.left_hand = AlignedError_mm(points.left, reference.left);
  return error;
}

}  // namespace holdfast
