// SPDX-License-Identifier: MIT
#include "geometry/import/parameter_array.h"

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/world_frame.h"

namespace holdfast {
namespace {

using Eigen::Index;

// Places in a row of Motion-X.
constexpr Index kMotionX = 322, kHandsAt = 66, kJawAt = 156, kExpressionAt = 159, kTransAt = 309,
                kBetasAt = 312, kNumBetas = 10;
constexpr double kMotionXFrameRate = 30;
constexpr int kArraySmplhJoints = 52;

[[noreturn]] void Refuse(const DataValue& value, const NpyMember& member, Index width) {
  const auto refuse = [&](const char* problem, const char* remedy) {
    throw Error(value.Where(), fmt::format("has shape {}: {}", member.ShapeText(), problem),
                remedy);
  };
  const std::vector<std::size_t>& shape = member.array.shape;
  if (width == 263 || width == 251) {
    refuse(
        "features of HumanML3D (263) or KIT-ML (251), which hold no rotations of SMPL-X's joints",
        "Give the AMASS file that they were made from, or joints fitted by an inverse-kinematics "
        "code");
  }
  if (width == 623) {
    refuse("features of HumanTOMATO, which hold no rotations of SMPL-X's joints",
           "Give the Motion-X file (frames, 322) that they were made from");
  }
  if (width == 7) {
    refuse("an object of ARCTIC: articulation, rotation, translation",
           "Give the .smplx.npy beside it: the object comes with it");
  }
  if (shape.size() == 3 && shape[2] == 3) {
    refuse("positions of joints, not rotations", "Fit a body to them first");
  }
  refuse("no layout of body parameters that is known without names",
         "Give (frames, 322) of Motion-X, (frames, 165) of SMPL-X, (frames, 156) of SMPL-H, or "
         "arrays with names in a .npz");
  throw std::logic_error("unreachable");
}

}  // namespace

ImportedClip ImportParameterArray(const DataValue& value, const ParameterOptions& options) {
  const NpyMember member = value.Array();
  const std::vector<std::size_t>& shape = member.array.shape;
  const Index width = shape.empty() ? 0 : static_cast<Index>(shape.back());
  const bool smplx = NumbersPerRotation(member, kNumJoints).has_value();
  // (T, 52, 3) may as well be positions.
  const bool smplh = !smplx && !(shape.size() == 3 && width == 3) &&
                     NumbersPerRotation(member, kArraySmplhJoints).has_value();
  if (width != kMotionX && !smplh && !smplx) Refuse(value, member, width);

  ImportedClip imported;
  Clip& clip = imported.clip;
  const double rate = options.source_frame_rate > 0 ? options.source_frame_rate : kMotionXFrameRate;
  clip.frame_rate = rate;
  std::optional<WorldUp> up;
  if (width == kMotionX) {
    imported.format = "Motion-X";
    const Eigen::MatrixXd rows = ReadFrameRows(value, kMotionX);
    clip.trans = rows.middleRows(kTransAt, 3);
    clip.pose.assign(static_cast<std::size_t>(rows.cols()), JointPose::Zero());
    SetJoints(clip.pose, 0, rows.topRows(kHandsAt), value.Where());
    SetJoints(clip.pose, kLeftHandBegin, rows.middleRows(kHandsAt, 2 * kHandDofs), value.Where());
    SetJoints(clip.pose, 22, rows.middleRows(kJawAt, 3), value.Where());
    SetBetas(rows.middleRows(kBetasAt, kNumBetas), imported);
    imported.conventions.push_back("finger angles complete");
    if (options.source_frame_rate == 0) {
      imported.notes.push_back(
          fmt::format("no frame rate in the file: Motion-X's {:g} Hz taken", rate));
    }
    if (!rows.middleRows(kExpressionAt, kTransAt - kExpressionAt).isZero(0.0)) {
      imported.dropped.push_back("expression and face shape: clips have no face");
    }
    up = WorldUp::kPlusY;
  } else {
    imported.format = smplx ? "SMPL-X poses, one array" : "SMPL-H poses, one array";
    const Eigen::MatrixXd rows =
        ReadRotations(value, smplx ? kNumJoints : kArraySmplhJoints, imported);
    clip.pose.assign(static_cast<std::size_t>(rows.cols()), JointPose::Zero());
    clip.trans.setZero(3, rows.cols());
    if (smplx) {
      SetJoints(clip.pose, 0, rows, value.Where());
    } else {
      SetJoints(clip.pose, 0, rows.topRows(3 * kNumBodyJoints), value.Where());
      SetJoints(clip.pose, kLeftHandBegin, rows.bottomRows(2 * kHandDofs), value.Where());
      clip.surface_model_type = "smplh";
    }
    imported.notes.push_back(
        fmt::format("warning: an array of poses alone: no translation, and {:g} Hz taken "
                    "('holdfast import --source-fps' says otherwise)",
                    rate));
    imported.conventions.push_back("finger angles taken as complete");
  }
  if (options.flat_hand_mean == false) {
    for (JointPose& pose : clip.pose) pose = AddHandMean(*options.body, pose);
    imported.conventions.push_back("as asked, the mean hand was added to the fingers");
  }
  SettleWorld(imported, options, up, true);
  return imported;
}

}  // namespace holdfast
