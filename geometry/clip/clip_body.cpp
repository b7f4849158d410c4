// SPDX-License-Identifier: MIT
#include "geometry/clip/clip_body.h"

#include <algorithm>

#include <fmt/format.h>

#include "geometry/body/default_hand.h"
#include "geometry/body/skeleton.h"
#include "geometry/error.h"

namespace holdfast {
namespace {

// Whether a body joint other than the root rotates: in a hand-only clip it would rotate the hand.
bool MovesABody(const Clip& clip) {
  return std::ranges::any_of(clip.pose, [](const JointPose& pose) {
    return !pose.middleCols<kNumBodyJoints - 1>(1).isZero(1e-9);
  });
}

void RequireSameKind(const std::string& source, const Clip& clip, const BodyModel& model) {
  const bool lone_model = model.LoneHand().has_value();
  if (IsHandAlone(clip) && !lone_model) {
    throw Error(source,
                fmt::format("is a motion of a hand alone (MANO), but {} is a whole-body model",
                            model.Name()),
                "Give the hand's model with --body MANO_RIGHT.pkl (or MANO_LEFT.pkl)");
  }
  if (lone_model && !IsHandAlone(clip) && MovesABody(clip)) {
    throw Error(source,
                fmt::format("is a whole-body motion, but {} is a model of a {} hand alone",
                            model.Name(), SideName(*model.LoneHand())),
                "Convert it to a hand's clip with 'holdfast convert --to-body', or give a "
                "whole-body model");
  }
}

// Betas of a clip that belong to `body`. Betas of another body's shape space are not meaningful:
// the mean shape is used then, with a note.
Eigen::VectorXd BetasFor(const Clip& clip, const BodyModel& body, std::vector<std::string>& notes) {
  if (clip.betas.size() == 0 || clip.betas.isZero(0.0)) return {};
  // Files of other programs do not name the model's file, only its family.
  const std::string& family = clip.surface_model_type;
  const bool same_family = body.Kind() == ModelKind::kSmplx ? body.Name().starts_with("SMPLX_")
                           : body.Kind() == ModelKind::kSmplh
                               ? family == "smplh"
                               : family.starts_with("mano") && body.NumShape() > 0;
  const bool same_space =
      clip.body_model == body.Name() || (clip.body_model.empty() && same_family);
  if (!same_space) {
    notes.push_back(
        fmt::format("the clip's betas belong to {0}, not to {1}: the mean shape of {1} is used "
                    "(give another model with --body MODEL.npz)",
                    !clip.body_model.empty() ? clip.body_model
                    : IsHandAlone(clip)      ? "MANO"
                                             : "SMPL-X",
                    body.Name()));
    return {};
  }
  if (std::string note = body.ShapeNote(); !note.empty()) notes.push_back(std::move(note));
  if (clip.betas.size() > body.NumShape()) {
    notes.push_back(fmt::format("the clip has {} betas, the model {}: the others are ignored",
                                clip.betas.size(), body.NumShape()));
    return clip.betas.head(body.NumShape());
  }
  return clip.betas;
}

}  // namespace

bool IsHandAlone(const Clip& clip) { return clip.surface_model_type.starts_with("mano"); }

void MarkHandAlone(Clip& clip) { clip.surface_model_type = "mano"; }

Side SideOfHandAlone(const Clip& clip) {
  const auto bends = [&](Side side) {
    return std::ranges::any_of(clip.pose, [&](const JointPose& pose) {
      return !pose.middleCols<kJointsPerHand>(HandBegin(side)).isZero(0.0);
    });
  };
  const bool left = bends(Side::kLeft), right = bends(Side::kRight);
  if (left != right) return left ? Side::kLeft : Side::kRight;
  const bool held_left =
      std::ranges::any_of(clip.holding_hand, [](std::uint8_t bits) { return bits == kHoldsLeft; });
  return held_left ? Side::kLeft : Side::kRight;
}

ClipBody BodyOfClip(const std::string& source, const Clip& clip,
                    std::shared_ptr<const BodyModel> model, std::vector<std::string>& notes) {
  if (IsHandAlone(clip) && model == BodyModel::Default()) {
    model = DefaultHand(SideOfHandAlone(clip));
  }
  RequireSameKind(source, clip, *model);
  const Eigen::Index vertices = clip.v_template.cols();
  if (vertices > 0 && vertices == model->NumVertices()) {
    return {BodyModel::WithTemplate(std::move(model), clip.v_template), {}};
  }
  if (vertices > 0) {
    notes.push_back(
        fmt::format("the subject's own surface has {} vertices, {} has {}: the surface is not used "
                    "(give its model with --body MODEL)",
                    vertices, model->Name(), model->NumVertices()));
  }
  Eigen::VectorXd betas = BetasFor(clip, *model, notes);
  return {std::move(model), std::move(betas)};
}

void RequireHands(const BodyModel& model, std::uint8_t bits) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if ((bits & HoldingBit(side)) == 0 || model.HasHand(side)) continue;
    throw Error(model.Source(), fmt::format("has no {} hand", SideName(side)),
                model.LoneHand()
                    ? fmt::format("It is a {} hand alone: give a whole body, or that "
                                  "hand with --hand {}",
                                  SideName(*model.LoneHand()), SideName(*model.LoneHand()))
                    : "Give a body with that hand");
  }
}

namespace {

enum class Family { kEmbedded, kSmplx, kSmplh, kOther };

constexpr double kNoShift_m = 1e-6;     // rounding of a model's file
constexpr double kNotedShift_m = 1e-3;  // smaller shifts are not reported

Family FamilyOf(const Clip& clip) {
  if (clip.body_model == BodyModel::kDefaultName) return Family::kEmbedded;
  if (clip.surface_model_type.starts_with("smplx")) return Family::kSmplx;
  const bool smpl = clip.surface_model_type == "smplh" || clip.surface_model_type == "smpl";
  return smpl ? Family::kSmplh : Family::kOther;
}

Family FamilyOf(const BodyModel& model) {
  if (model.Name() == BodyModel::kDefaultName) return Family::kEmbedded;
  if (model.LoneHand()) return Family::kOther;
  return model.Kind() == ModelKind::kSmplh ? Family::kSmplh : Family::kSmplx;
}

Eigen::Vector3d PelvisOf(const BodyModel& model, const Eigen::VectorXd& betas) {
  return model.RestJoints(model.ShapedVertices(betas)).col(0);
}

}  // namespace

std::optional<BodyChange> BringOntoBody(Clip& clip, const ClipBody& body) {
  const Family from = FamilyOf(clip), to = FamilyOf(*body.model);
  if (from == to || from == Family::kOther || to == Family::kOther) return std::nullopt;
  BodyChange change;
  change.from = !clip.body_model.empty() ? clip.body_model
                : from == Family::kSmplx ? "SMPL-X"
                                         : "SMPL-H";
  Eigen::Vector3d pelvis;
  if (from == Family::kEmbedded) {
    const std::shared_ptr<const BodyModel> embedded = BodyModel::Default();
    const bool own_surface = clip.v_template.cols() == embedded->NumVertices();
    const bool shaped = clip.betas.size() <= embedded->NumShape();
    pelvis = own_surface ? Eigen::Vector3d(embedded->RestJoints(clip.v_template).col(0))
                         : PelvisOf(*embedded, shaped ? clip.betas : Eigen::VectorXd());
  } else {
    pelvis = from == Family::kSmplx ? kSmplxRestPelvis : kSmplhRestPelvis;
  }
  change.offset = pelvis - PelvisOf(*body.model, body.betas);
  if (change.offset.norm() < kNoShift_m) change.offset.setZero();
  clip.trans.colwise() += change.offset;
  clip.betas = body.betas;
  // BodyOfClip uses a surface of the model's vertex count as the body: without it the clip would
  // show a different hand from the measured one.
  if (clip.v_template.cols() != body.model->NumVertices()) clip.v_template.resize(3, 0);
  if (clip.contact) clip.contact->body.resize(0, 0);
  clip.body_model = body.model->Name();
  clip.surface_model_type = ModelKindName(body.model->Kind());
  return change;
}

std::string Describe(const BodyChange& change, const BodyModel& to) {
  if (change.offset.norm() < kNotedShift_m) {
    return fmt::format(
        "made with {}: limbs and hands of {} have other proportions (give the original model with "
        "--body MODEL.npz)",
        change.from, to.Name());
  }
  return fmt::format(
      "made with {}: on {} trans is moved by ({:.3f}, {:.3f}, {:.3f}) m because the rest pelvis of "
      "the two models differs; limbs and hands have other proportions (give the original model "
      "with --body MODEL.npz)",
      change.from, to.Name(), change.offset.x(), change.offset.y(), change.offset.z());
}

}  // namespace holdfast
