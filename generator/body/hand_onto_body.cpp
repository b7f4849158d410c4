// SPDX-License-Identifier: MIT
#include "generator/body/hand_onto_body.h"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "generator/body/pose_builder.h"
#include "geometry/body/hand_model.h"
#include "geometry/error.h"

namespace holdfast {

HandOntoBodyReport PutHandOntoBody(const Clip& hand, const BodyModel& hand_model,
                                   const Eigen::VectorXd& hand_betas, const BodyModel& body_model,
                                   const Eigen::VectorXd& body_betas, Clip& body) {
  if (!hand_model.LoneHand() || body_model.LoneHand()) {
    throw Error(hand_model.Name(),
                fmt::format("cannot be combined with {}: a hand and a whole body are required",
                            body_model.Name()),
                "Give a MANO model and a whole-body model");
  }
  if (hand.NumFrames() != body.NumFrames()) {
    throw Error(
        "hand",
        fmt::format("has {} frames, but the body has {}", hand.NumFrames(), body.NumFrames()),
        "Give clips of the same length");
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
    report.max_missing_mm = std::max(report.max_missing_mm, missing);
    if (missing > 1.0) ++report.frames_out_of_reach;
  }
  return report;
}

Conversion ConvertOntoBody(const Clip& hand, const ClipBody& from, Clip onto,
                           const ClipBody& person) {
  Conversion result;
  Clip& body = result.clip;
  body = std::move(onto);
  result.arms = PutHandOntoBody(hand, *from.model, from.betas, *person.model, person.betas, body);
  const auto rest = [](const ClipBody& of) {
    return of.model->RestJoints(of.model->ShapedVertices(of.betas));
  };
  result.joints =
      CompareJoints(hand, rest(from), body, rest(person), CommonJoints(*from.model, *person.model));
  for (const JointResidual& joint : result.joints) {
    result.mean_mm += joint.mean_mm / static_cast<double>(result.joints.size());
    result.max_mm = std::max(result.max_mm, joint.max_mm);
  }
  if (hand.object) body.object = hand.object;
  body.holding_hand = hand.holding_hand;
  result.lost = {"the hand's betas (the body has its own)"};
  return result;
}

nlohmann::json ConversionJson(const Conversion& conversion) {
  nlohmann::json joints = nlohmann::json::object();
  for (const JointResidual& joint : conversion.joints) {
    joints[std::string(kJointNames[static_cast<std::size_t>(joint.joint)])] = {
        {"mean_mm", joint.mean_mm}, {"max_mm", joint.max_mm}};
  }
  nlohmann::json json = {
      {"residual",
       {{"joints", joints}, {"mean_mm", conversion.mean_mm}, {"max_mm", conversion.max_mm}}},
      {"not_carried_over", conversion.lost}};
  if (conversion.vertex_mean_mm) {
    json["residual"]["vertex_mean_mm"] = *conversion.vertex_mean_mm;
    json["residual"]["vertex_max_mm"] = *conversion.vertex_max_mm;
  }
  if (conversion.arms) {
    json["arm"] = {{"frames_out_of_reach", conversion.arms->frames_out_of_reach},
                   {"max_missing_mm", conversion.arms->max_missing_mm}};
  }
  return json;
}

}  // namespace holdfast
