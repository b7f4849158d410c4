// SPDX-License-Identifier: MIT
#include "apps/clip_body.h"

#include <algorithm>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::apps {
namespace {

// Whether any joint above the fingers but the root turns: on a hand alone they would turn the hand.
bool MovesABody(const Clip& clip) {
  return std::ranges::any_of(clip.pose, [](const JointPose& pose) {
    return !pose.middleCols<kNumBodyJoints - 1>(1).isZero(1e-9);
  });
}

void RequireSameKind(const std::string& source, const Clip& clip, const BodyModel& model) {
  const bool lone_model = model.LoneHand().has_value();
  if (IsHandAlone(clip) && !lone_model) {
    throw Error(source, fmt::format("is of a hand alone (MANO), {} is a whole body", model.Name()),
                "Give the hand's model with --body MANO_RIGHT.pkl (or MANO_LEFT.pkl)");
  }
  if (lone_model && !IsHandAlone(clip) && MovesABody(clip)) {
    throw Error(source,
                fmt::format("is of a whole body, {} is a {} hand alone", model.Name(),
                            SideName(*model.LoneHand())),
                "Make a hand's clip of it with 'holdfast convert --to-body', or give a body");
  }
}

}  // namespace

bool IsHandAlone(const Clip& clip) { return clip.surface_model_type.starts_with("mano"); }

void MarkHandAlone(Clip& clip) { clip.surface_model_type = "mano"; }

ClipBody BodyOfClip(const std::string& source, const Clip& clip,
                    std::shared_ptr<const BodyModel> model, const CommonOptions& options) {
  RequireSameKind(source, clip, *model);
  const Eigen::Index vertices = clip.v_template.cols();
  if (vertices > 0 && vertices == model->NumVertices()) {
    return {BodyModel::WithTemplate(std::move(model), clip.v_template), {}};
  }
  if (vertices > 0) {
    Note(options,
         fmt::format("note: the subject's own surface has {} vertices, {} has {}: it is not used "
                     "(--body MODEL gives the model that it belongs to)",
                     vertices, model->Name(), model->NumVertices()));
  }
  Eigen::VectorXd betas = BetasFor(clip, *model, options);
  return {std::move(model), std::move(betas)};
}

void RequireHands(const BodyModel& model, std::uint8_t bits) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const std::uint8_t bit = side == Side::kRight ? kHoldsRight : kHoldsLeft;
    if ((bits & bit) == 0 || model.HasHand(side)) continue;
    throw Error(model.Name(), fmt::format("has no {} hand", SideName(side)),
                model.LoneHand()
                    ? fmt::format("It is a {} hand alone: give a whole body, or that "
                                  "hand with --hand {}",
                                  SideName(*model.LoneHand()), SideName(*model.LoneHand()))
                    : "Give a body with that hand");
  }
}

}  // namespace holdfast::apps
