// SPDX-License-Identifier: MIT
#include "generator/body/hand_onto_body.h"

#include <algorithm>

#include <fmt/format.h>

#include "generator/body/arm_correction.h"
#include "geometry/body/hand_model.h"
#include "geometry/error.h"

namespace holdfast {

HandOntoBodyReport PutHandOntoBody(const Clip& hand, const BodyModel& hand_model,
                                   const Eigen::VectorXd& hand_betas, const BodyModel& body_model,
                                   const Eigen::VectorXd& body_betas, Clip& body) {
  if (!hand_model.LoneHand() || body_model.LoneHand()) {
    throw Error(hand_model.Name(),
                fmt::format("onto {}: a hand goes onto a body", body_model.Name()),
                "Give a MANO model and a whole body");
  }
  if (hand.NumFrames() != body.NumFrames()) {
    throw Error("hand",
                fmt::format("has {} frames, the body {}", hand.NumFrames(), body.NumFrames()),
                "Give clips of one length");
  }
  const Side side = *hand_model.LoneHand();
  const auto wrist = static_cast<std::size_t>(WristJoint(side));
  const Eigen::Matrix3Xd hand_rest = hand_model.RestJoints(hand_model.ShapedVertices(hand_betas));
  const Eigen::Matrix3Xd body_rest = body_model.RestJoints(body_model.ShapedVertices(body_betas));
  HandOntoBodyReport report;
  BodyState state;
  for (int t = 0; t < hand.NumFrames(); ++t) {
    const JointPose& source = hand.pose[static_cast<std::size_t>(t)];
    JointPose& pose = body.pose[static_cast<std::size_t>(t)];
    ForwardJoints(hand_rest, source, hand.trans.col(t), state);
    const double missing = 1e3 * MoveWrist(body_rest, side, state.world_rotation[wrist],
                                           state.joints.col(static_cast<Eigen::Index>(wrist)),
                                           body.trans.col(t), pose);
    SetFingers(pose, side, FingersOf(source, side));
    report.mean_missing_mm += missing / hand.NumFrames();
    report.max_missing_mm = std::max(report.max_missing_mm, missing);
    if (missing > 1.0) ++report.frames_out_of_reach;
  }
  return report;
}

}  // namespace holdfast
