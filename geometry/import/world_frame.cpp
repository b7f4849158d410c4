// SPDX-License-Identifier: MIT
#include "geometry/import/world_frame.h"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/body/skeleton.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr std::array<std::string_view, 6> kNames = {"x", "-x", "y", "-y", "z", "-z"};

LooseMotion MotionOf(const Clip& clip) {
  LooseMotion motion;
  motion.frames = clip.NumFrames();
  motion.frame_rate = clip.frame_rate;
  motion.has_trans = motion.has_root = motion.has_body = true;
  motion.num_joints = kNumJoints;
  motion.trans = clip.trans;
  motion.pose = clip.pose;
  return motion;
}

void Turn(ObjectTrack& track, const Eigen::Matrix3d& Q) {
  track.trans = Q * track.trans;
  for (Eigen::Index t = 0; t < track.orient.cols(); ++t) {
    track.orient.col(t) = LogSO3(Q * ExpSO3(track.orient.col(t)));
  }
}

}  // namespace

std::string_view WorldUpName(WorldUp up) { return kNames[static_cast<std::size_t>(up)]; }

std::optional<WorldUp> ParseWorldUp(std::string_view text) {
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (kNames[i] == text) return static_cast<WorldUp>(i);
  }
  return std::nullopt;
}

Eigen::Matrix3d ZUpFrom(WorldUp up) {
  const int axis = static_cast<int>(up) / 2;
  const double sign = static_cast<int>(up) % 2 == 0 ? 1 : -1;
  // A half turn has no unique axis: turn about x, so that left stays left.
  if (up == WorldUp::kMinusZ) return Eigen::Vector3d(1, -1, -1).asDiagonal();
  return RotationBetween(sign * Eigen::Vector3d::Unit(axis), Eigen::Vector3d::UnitZ())
      .toRotationMatrix()
      .unaryExpr([](double x) { return std::round(x); });  // exact: entries are 0 and +-1
}

void TurnWorld(Clip& clip, const Eigen::Matrix3d& Q, const Eigen::Vector3d& pelvis) {
  for (int t = 0; t < clip.NumFrames(); ++t) {
    JointPose& pose = clip.pose[static_cast<std::size_t>(t)];
    pose.col(0) = LogSO3(Q * ExpSO3(pose.col(0)));
    clip.trans.col(t) = Q * (pelvis + clip.trans.col(t)) - pelvis;
  }
  if (clip.object) Turn(*clip.object, Q);
  if (clip.table) Turn(*clip.table, Q);
}

void MoveWorld(Clip& clip, const Eigen::Vector3d& offset) {
  clip.trans.colwise() += offset;
  if (clip.object) clip.object->trans.colwise() += offset;
  if (clip.table) clip.table->trans.colwise() += offset;
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

std::optional<WorldUp> UprightAxis(const Clip& clip, const BodyModel& body) {
  const Posture posture = MeasurePosture(MotionOf(clip), body);
  if (!posture.up_is_certain) return std::nullopt;
  return static_cast<WorldUp>(2 * posture.axis + (posture.sign < 0 ? 1 : 0));
}

void SettleWorld(ImportedClip& imported, const ParameterOptions& options,
                 std::optional<WorldUp> known, bool find_ground) {
  Clip& clip = imported.clip;
  if (options.meters_per_unit != 1) {
    clip.trans *= options.meters_per_unit;
    if (clip.object) clip.object->trans *= options.meters_per_unit;
    if (clip.table) clip.table->trans *= options.meters_per_unit;
    imported.conventions.push_back(
        fmt::format("positions multiplied by {:g}", options.meters_per_unit));
  }
  std::optional<WorldUp> up = options.up ? options.up : known;
  if (!up) {
    const Posture posture = MeasurePosture(MotionOf(clip), *options.body);
    up = static_cast<WorldUp>(2 * posture.axis + (posture.sign < 0 ? 1 : 0));
    imported.notes.push_back(
        fmt::format("the file does not state the up axis: {} is used, along which the head is "
                    "above the feet{} (--up overrides this)",
                    WorldUpName(*up), posture.up_is_certain ? "" : ", though not in all frames"));
  }
  if (*up != WorldUp::kPlusZ) {
    if (clip.surface_model_type == "mano" && !options.body->LoneHand()) {
      throw Error("--up",
                  "a hand alone rotates about its wrist, whose position only its own model has",
                  "Give that model with --body MANO_RIGHT.pkl (or MANO_LEFT.pkl)");
    }
    TurnWorld(clip, ZUpFrom(*up), PelvisOf(clip, *options.body));
    imported.conventions.push_back(
        fmt::format("the file's world is {}-up: rotated to z-up about the pelvis of the rest pose",
                    WorldUpName(*up)));
  } else {
    imported.conventions.push_back("the file's world is z-up, as a clip's");
  }
  if (!find_ground || !options.find_ground) return;
  const Posture posture = MeasurePosture(MotionOf(clip), *options.body);
  if (posture.unit_is_certain && posture.meters_per_unit != 1) {
    imported.notes.push_back(fmt::format(
        "positions seem to be in {}: if so, use --meters-per-unit {:g}",
        posture.meters_per_unit == 0.01 ? "centimeters" : "millimeters", posture.meters_per_unit));
    return;
  }
  const double ground = posture.ground_m;
  if (!std::isfinite(ground) || std::abs(ground) < 1e-4) return;
  MoveWorld(clip, Eigen::Vector3d(0, 0, -ground));
  imported.conventions.push_back(
      fmt::format("the floor was at z = {:+.3f} m, judged by the feet: everything was moved by "
                  "{:+.3f} m (--keep-ground disables this)",
                  ground, -ground));
}

}  // namespace holdfast
