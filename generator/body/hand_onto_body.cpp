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

OptionTable OptionsOf(ConvertOptions& options) {
  OptionTable table;
  table.Choice("from_hands", options.from_hands,
               {{"auto", HandConvention::kAuto},
                {"complete", HandConvention::kComplete},
                {"relative", HandConvention::kRelative}},
               "Finger angles of the clip: complete (flat_hand_mean), relative to its model's mean "
               "hand, or auto: by the clip's format");
  table.Number("betas", "", options.betas, {0, 300},
               "Number of shape coefficients to solve for; 0: the mean shape");
  return table;
}

ImportFileOptions ImportToConvert(const ConvertOptions& options) {
  ImportFileOptions import;
  import.parameters.up = UpAxis::kZ;
  import.parameters.keep_ground = true;
  if (options.from_hands != HandConvention::kAuto) {
    import.parameters.flat_hand_mean = options.from_hands == HandConvention::kComplete;
  }
  return import;
}

void CompleteHands(const ConvertOptions& options, const BodyModel& from, Clip& clip) {
  if (options.from_hands != HandConvention::kRelative) return;
  for (JointPose& pose : clip.pose) pose = AddHandMean(from, pose);
}

OptionTable OptionsOf(ParameterFileOptions& options) {
  OptionTable table;
  table.Choice("layout", options.layout,
               {{"auto", "auto"},
                {"amass", "amass"},
                {"smplx", "smplx"},
                {"smplh", "smplh"},
                {"mano", "mano"}},
               "Array names: amass (AMASS); smplx, smplh or mano (arguments of the smplx package); "
               "auto (from the file extension)");
  table.Choice("to_hands", options.to_hands,
               {{"complete", HandConvention::kComplete}, {"relative", HandConvention::kRelative}},
               "Finger angles of the result: complete (flat_hand_mean), or relative to its model's "
               "mean hand");
  return table;
}

ParameterLayout LayoutOf(const BodyModel& model, const ParameterFileOptions& options,
                         const std::filesystem::path& path) {
  const std::string family = model.LoneHand() ? "mano" : std::string(ModelKindName(model.Kind()));
  ParameterLayout layout = ParameterLayout::kPackage;
  if (options.layout == "auto" ? path.extension() != ".json" : options.layout == "amass") {
    layout = ParameterLayout::kAmass;
  } else if (options.layout != "auto" && options.layout != family) {
    throw Error("layout " + options.layout,
                fmt::format("the parameters are those of a {} model", family),
                fmt::format("Give {}, amass or auto", family));
  }
  return layout;
}

void WriteParameters(Clip clip, const BodyModel& model, const ParameterFileOptions& options,
                     const std::filesystem::path& path) {
  const ParameterLayout layout = LayoutOf(model, options, path);
  const bool complete = options.to_hands == HandConvention::kComplete;
  if (!complete) {
    for (JointPose& pose : clip.pose) pose = RemoveHandMean(model, pose);
  }
  WriteParameters(clip, model.Kind(), layout, complete, path);
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
