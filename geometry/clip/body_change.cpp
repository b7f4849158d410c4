// SPDX-License-Identifier: MIT
#include "geometry/clip/body_change.h"

#include <fmt/format.h>

#include "geometry/body/rest_pelvis.h"

namespace holdfast {
namespace {

enum class Family { kEmbedded, kSmplx, kSmplh, kOther };

constexpr double kNoShift_m = 1e-6;     // the rounding of a model's file
constexpr double kNotedShift_m = 1e-3;  // a smaller one is no news

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
  // BodyOfClip takes a surface of the model's vertices for the body: without it the clip would show
  // another hand than the one that is measured.
  if (clip.v_template.cols() != body.model->NumVertices()) clip.v_template.resize(3, 0);
  if (clip.contact) clip.contact->body.resize(0, 0);
  clip.body_model = body.model->Name();
  clip.surface_model_type = ModelKindName(body.model->Kind());
  return change;
}

std::string Describe(const BodyChange& change, const BodyModel& to) {
  if (change.offset.norm() < kNotedShift_m) {
    return fmt::format(
        "made with {}: limbs and hands of {} are not the clip's own (--body MODEL.npz takes its "
        "model)",
        change.from, to.Name());
  }
  return fmt::format(
      "made with {}: on {} trans is moved by ({:.3f}, {:.3f}, {:.3f}) m, from the rest pelvis of "
      "the one's mean shape to the other's; limbs and hands are not the clip's own (--body "
      "MODEL.npz takes its model)",
      change.from, to.Name(), change.offset.x(), change.offset.y(), change.offset.z());
}

}  // namespace holdfast
