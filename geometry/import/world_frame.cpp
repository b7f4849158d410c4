// SPDX-License-Identifier: MIT
#include "geometry/import/world_frame.h"

#include <cmath>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/body/default_hand.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip_body.h"
#include "geometry/conventions/loose_motion.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

UpAxis AxisOf(const Posture& posture) {
  return static_cast<UpAxis>(2 * posture.axis + (posture.sign < 0 ? 1 : 0));
}

void Turn(ObjectTrack& track, const Eigen::Matrix3d& Q) {
  track.trans = Q * track.trans;
  for (Eigen::Index t = 0; t < track.orient.cols(); ++t) {
    track.orient.col(t) = LogSO3(Q * ExpSO3(track.orient.col(t)));
  }
}

}  // namespace

std::vector<std::pair<std::string, std::optional<UpAxis>>> UpAxisChoices() {
  std::vector<std::pair<std::string, std::optional<UpAxis>>> axes = {{"auto", std::nullopt}};
  for (const UpAxis up :
       {UpAxis::kX, UpAxis::kY, UpAxis::kZ, UpAxis::kMinusX, UpAxis::kMinusY, UpAxis::kMinusZ}) {
    axes.emplace_back(UpAxisName(up), up);
  }
  return axes;
}

Eigen::Matrix3d ZUpFrom(UpAxis up) {
  const int axis = static_cast<int>(up) / 2;
  const double sign = static_cast<int>(up) % 2 == 0 ? 1 : -1;
  // A half turn has no unique axis: turn about x, so that left stays left.
  if (up == UpAxis::kMinusZ) return Eigen::Vector3d(1, -1, -1).asDiagonal();
  return RotationBetween(sign * Eigen::Vector3d::Unit(axis), Eigen::Vector3d::UnitZ())
      .toRotationMatrix()
      .unaryExpr([](double x) { return std::round(x); });  // exact: entries are 0 and +-1
}

void TurnWorld(Clip& clip, const Eigen::Matrix3d& Q, const Eigen::Vector3d& pelvis) {
  for (int t = 0; t < clip.NumFrames(); ++t) {
    JointPose& pose = clip.pose[t];
    pose.col(0) = LogSO3(Q * ExpSO3(pose.col(0)));
    clip.trans.col(t) = Q * (pelvis + clip.trans.col(t)) - pelvis;
  }
  if (clip.object) Turn(*clip.object, Q);
  if (clip.table) Turn(*clip.table, Q);
}

Eigen::Vector3d PelvisOf(const Clip& clip, const BodyModel& body) {
  if (clip.v_template.cols() == body.NumVertices()) {
    return body.RestJoints(clip.v_template).col(0);
  }
  // Mean shape of a model that is not loaded.
  const std::string& type = clip.surface_model_type;
  if (clip.body_model.empty() && body.Kind() == ModelKind::kSmplx) {
    if (type == "smplh" || type == "smpl") return kSmplhRestPelvis;
  } else if (clip.body_model.empty() && body.Kind() == ModelKind::kSmplh) {
    if (type.starts_with("smplx")) return kSmplxRestPelvis;
  }
  const bool same_space = body.Name().starts_with("SMPLX_") || clip.body_model == body.Name();
  if (same_space && clip.v_template.cols() == 0) {
    const Eigen::Index usable = std::min<Eigen::Index>(clip.betas.size(), body.NumShape());
    return body.RestJoints(body.ShapedVertices(clip.betas.head(usable))).col(0);
  }
  return body.RestJoints(body.Template()).col(0);
}

std::optional<UpAxis> UprightAxis(const Clip& clip, const BodyModel& body) {
  const Posture posture = MeasurePosture(LooseMotionOf(clip), body);
  return posture.up_is_certain ? std::optional(AxisOf(posture)) : std::nullopt;
}

void SettleWorld(ImportedClip& imported, const ParameterOptions& options,
                 std::optional<UpAxis> known, bool find_ground) {
  Clip& clip = imported.clip;
  if (const double unit = options.meters_per_unit.value_or(1.0); unit != 1.0) {
    clip.trans *= unit;
    if (clip.object) clip.object->trans *= unit;
    if (clip.table) clip.table->trans *= unit;
    imported.conventions.push_back(fmt::format("positions multiplied by {:g}", unit));
  }
  std::optional<UpAxis> up = options.up ? options.up : known;
  if (!up) {
    const Posture posture = MeasurePosture(LooseMotionOf(clip), *options.body);
    up = AxisOf(posture);
    imported.notes.push_back(
        fmt::format("the file does not state the up axis: {} is used, along which the head is "
                    "above the feet{} (--up overrides this)",
                    UpAxisName(*up), posture.up_is_certain ? "" : ", though not in all frames"));
  }
  if (*up != UpAxis::kZ) {
    const bool own_hand = IsHandAlone(clip) && !options.body->LoneHand();
    const std::shared_ptr<const BodyModel> body =
        own_hand ? DefaultHand(SideOfHandAlone(clip)) : options.body;
    TurnWorld(clip, ZUpFrom(*up), PelvisOf(clip, *body));
    imported.conventions.push_back(
        fmt::format("the file's world is {}-up: rotated to z-up about the {} of the rest pose",
                    UpAxisName(*up), IsHandAlone(clip) ? "wrist" : "pelvis"));
  } else {
    imported.conventions.push_back("the file's world is z-up, as a clip's");
  }
  if (!find_ground || options.keep_ground) return;
  const Posture posture = MeasurePosture(LooseMotionOf(clip), *options.body);
  if (posture.unit_is_certain && posture.meters_per_unit != 1) {
    imported.notes.push_back(fmt::format(
        "positions seem to be in {}: if so, use --meters-per-unit {:g}",
        posture.meters_per_unit == 0.01 ? "centimeters" : "millimeters", posture.meters_per_unit));
    return;
  }
  const double ground = posture.ground_m;
  if (!std::isfinite(ground) || std::abs(ground) < 1e-4) return;
  const Eigen::Vector3d offset(0, 0, -ground);
  clip.trans.colwise() += offset;
  if (clip.object) clip.object->trans.colwise() += offset;
  if (clip.table) clip.table->trans.colwise() += offset;
  imported.conventions.push_back(
      fmt::format("the floor was at z = {:+.3f} m, judged by the feet: everything was moved by "
                  "{:+.3f} m (--keep-ground disables this)",
                  ground, -ground));
}

}  // namespace holdfast
