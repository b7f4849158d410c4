// SPDX-License-Identifier: MIT
#include "geometry/import/mano_parameters.h"

#include <fmt/format.h>

#include "geometry/import/finger_angles.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"

namespace holdfast {
namespace {

Side SideOf(const Fields& fields, const ParameterOptions& options, ImportedClip& imported) {
  if (const auto right = fields.Find("is_rhand"); right && right->HoldsNumbers()) {
    return right->Number() != 0 ? Side::kRight : Side::kLeft;
  }
  if (options.hands == ImportedHands::kLeftAlone) return Side::kLeft;
  if (options.hands != ImportedHands::kRightAlone) {
    imported.notes.push_back(
        "which hand it is the file does not tell: a right one taken (--hands lhand says "
        "otherwise)");
  }
  return Side::kRight;
}

}  // namespace

ImportedClip ReadHandAlone(const Fields& fields, const HandFieldNames& names, Side side, bool flat,
                           const ParameterOptions& options) {
  ImportedClip imported;
  Clip& clip = imported.clip;
  const DataValue pose = fields[names.pose], orient = fields[names.orient];
  clip.trans = ReadFrameRows(fields[names.trans], 3);
  clip.pose = RestPoses(clip.trans.cols(), pose, NumbersPerHand(pose));
  SetJoints(clip.pose, 0, ReadRotations(orient, 1, imported.body_defects), orient.Where());
  FingerAngles fingers(options);
  SetJoints(clip.pose, HandBegin(side), fingers.Read(pose, side, imported.body_defects),
            pose.Where());
  if (!flat) fingers.AddMean(clip.pose);
  if (const auto betas = fields.Find(names.betas)) {
    const NpyMember shape = betas->Array();
    if (shape.array.NumElements() > 0 && !shape.array.shape.empty()) {
      const auto count = static_cast<Eigen::Index>(shape.array.shape.back());
      clip.betas = ReadFrameRows(*betas, count).rowwise().mean();
    }
  }
  clip.surface_model_type = "mano";
  Append(imported.conventions, fingers.Conventions());
  Append(imported.notes, fingers.Notes());
  return imported;
}

bool LooksLikeMano(const Fields& fields) {
  return fields.Has("global_orient") && fields.Has("hand_pose") && fields.Has("transl") &&
         !fields.Has("body_pose");
}

ImportedClip ImportMano(const Fields& fields, const ParameterOptions& options) {
  ImportedClip told;
  const Side side = SideOf(fields, options, told);
  const bool flat = options.flat_hand_mean.value_or(FlatHandMeanOf(fields).value_or(false));
  ImportedClip imported =
      ReadHandAlone(fields, {"global_orient", "hand_pose", "transl", "betas"}, side, flat, options);
  imported.format = fmt::format("MANO parameters of a {} hand", SideName(side));
  Append(imported.notes, told.notes);
  imported.clip.frame_rate = FrameRateOf(fields).value_or(30.0);
  if (options.source_frame_rate > 0) imported.clip.frame_rate = options.source_frame_rate;
  if (const auto gender = fields.Find("gender")) {
    if (const auto known = GenderOf(*gender)) imported.clip.gender = *known;
  }
  SettleWorld(imported, options, WorldUp::kPlusZ, false);
  return imported;
}

}  // namespace holdfast
