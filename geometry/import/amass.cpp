// SPDX-License-Identifier: MIT
#include "geometry/import/amass.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/finger_angles.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/world_frame.h"

namespace holdfast {
namespace {

using Eigen::Index;

constexpr std::array<std::string_view, 2> kFrameRates = {"mocap_frame_rate", "mocap_framerate"};
constexpr int kSmplhJoints = 52;
constexpr int kSmplJoints = 24;

double ReadAmassFrameRate(const Fields& fields, const ParameterOptions& options,
                          ImportedClip& imported) {
  if (const auto rate = fields.Find(kFrameRates)) {
    const double value = rate->Number();
    if (!(value > 0) || !std::isfinite(value)) {
      throw Error(rate->Where(), fmt::format("is {}", value), "Give frames per second");
    }
    return value;
  }
  const double rate = options.source_frame_rate > 0 ? options.source_frame_rate : 30;
  imported.notes.push_back(
      fmt::format("the file has no frame rate: {:g} Hz taken (--source-fps says otherwise)", rate));
  return rate;
}

// Numbers a frame of `poses`.
Index WidthOf(const NpyMember& poses) {
  const std::vector<std::size_t>& shape = poses.array.shape;
  if (shape.size() < 2 || shape[0] == 0) return 0;
  return static_cast<Index>(poses.array.NumElements() / shape[0]);
}

void ReadConcatenated(const Fields& fields, ImportedClip& imported) {
  Clip& clip = imported.clip;
  const DataValue poses = fields["poses"];
  const Index width = WidthOf(poses.Array());
  const auto read = [&](int joints) { return ReadRotations(poses, joints, imported.body_defects); };
  if (width == 3 * kNumJoints || width == 9 * kNumJoints) {
    imported.format = "AMASS, SMPL-X";
    SetJoints(clip.pose, 0, read(kNumJoints), poses.Where());
  } else if (width == 3 * kSmplhJoints || width == 9 * kSmplhJoints) {
    imported.format = "AMASS, SMPL-H";
    const Eigen::MatrixXd all = read(kSmplhJoints);
    SetJoints(clip.pose, 0, all.topRows(3 * kNumBodyJoints), poses.Where());
    SetJoints(clip.pose, kLeftHandBegin, all.bottomRows(2 * kHandDofs), poses.Where());
    clip.surface_model_type = "smplh";
    imported.conventions.push_back("52 joints of SMPL-H: jaw and eyes at rest");
  } else if (width == 3 * kSmplJoints || width == 9 * kSmplJoints) {
    imported.format = "AMASS, SMPL";
    SetJoints(clip.pose, 0, read(kSmplJoints).topRows(3 * kNumBodyJoints), poses.Where());
    clip.surface_model_type = "smpl";
    imported.conventions.push_back("24 joints of SMPL: its two hand joints dropped");
  } else {
    const NpyMember member = poses.Array();
    throw Error(poses.Where(), fmt::format("has shape {}", member.ShapeText()),
                "Give (frames, 165) of SMPL-X, (frames, 156) of SMPL-H or (frames, 72) of SMPL");
  }
}

void ReadParts(const Fields& fields, ImportedClip& imported) {
  Clip& clip = imported.clip;
  imported.format = "AMASS, SMPL-X";
  for (const auto& [name, begin, joints, needed] :
       {std::tuple{"root_orient", 0, 1, true},
        {"pose_body", 1, 21, true},
        {"pose_jaw", 22, 1, false},
        {"pose_eye", 23, 2, false},
        {"pose_hand", kLeftHandBegin, 2 * kJointsPerHand, false}}) {
    if (!needed && !fields.Has(name)) continue;
    const DataValue value = fields[name];
    SetJoints(clip.pose, begin, ReadRotations(value, joints, imported.body_defects), value.Where());
  }
}

// Fingers that stay as they are through a long clip were not captured.
bool FingersStand(const Clip& clip) {
  const auto fingers = [&](std::size_t t) { return clip.pose[t].rightCols(2 * kJointsPerHand); };
  for (std::size_t t = 1; t < clip.pose.size(); ++t) {
    if ((fingers(t) - fingers(0)).cwiseAbs().maxCoeff() > 1e-6) return false;
  }
  return true;
}

}  // namespace

bool LooksLikeAmass(const Fields& fields) {
  return fields.Has("trans") &&
         (fields.Has("poses") || (fields.Has("root_orient") && fields.Has("pose_body")));
}

ImportedClip ImportAmass(const Fields& fields, const ParameterOptions& options) {
  ImportedClip imported;
  Clip& clip = imported.clip;
  clip.frame_rate = ReadAmassFrameRate(fields, options, imported);
  clip.trans = ReadFrameRows(fields["trans"], 3);
  const Index frames = clip.trans.cols();
  const bool parts = fields.Has("root_orient") && fields.Has("pose_body");
  clip.pose = RestPoses(frames, fields[parts ? "pose_body" : "poses"], 63);
  if (parts) {
    ReadParts(fields, imported);
  } else {
    ReadConcatenated(fields, imported);
  }
  const bool has_fingers =
      clip.surface_model_type == "smplh" || (parts ? fields.Has("pose_hand") : true);
  if (clip.surface_model_type != "smpl" && has_fingers) {
    imported.conventions.push_back("finger angles are complete (AMASS adds no mean hand)");
    if (options.flat_hand_mean == false) {
      for (JointPose& pose : clip.pose) pose = AddHandMean(*options.body, pose);
      imported.conventions.back() = "finger angles taken as differences from the mean hand, added";
    } else if (FingersLookFlat(clip, *options.body) == false) {
      imported.notes.push_back(
          "relaxed fingers are near zero, not near a mean hand, as if angles were differences from "
          "it (--flat-hand-mean no if so)");
    }
    if (frames > 1 && FingersStand(clip)) {
      imported.notes.push_back("the fingers stand still all through: they were not captured");
    }
  }
  if (clip.surface_model_type == "smpl") {
    for (JointPose& pose : clip.pose) pose = AddHandMean(*options.body, pose);
    imported.notes.push_back(
        fmt::format("SMPL has no fingers: the relaxed hand of {} taken", options.body->Name()));
  }
  if (const auto betas = fields.Find("betas")) {
    const Index count = static_cast<Index>(betas->Array().array.NumElements());
    if (count > 0) clip.betas = ReadFrameRows(*betas, count).col(0);
  }
  if (const auto gender = fields.Find("gender")) {
    clip.gender = GenderOf(*gender).value_or("neutral");
  }
  for (const auto& [name, why] : {std::pair{"dmpls", "soft tissue has no place in a clip"},
                                  {"expression", "clips have no face"},
                                  {"face_expr", "clips have no face"}}) {
    if (fields.Has(name)) imported.dropped.push_back(fmt::format("{}: {}", name, why));
  }
  std::vector<std::string> markers;
  for (const std::string& name : fields.Names()) {
    if (name.starts_with("markers") || name.starts_with("labels")) markers.push_back(name);
  }
  if (!markers.empty()) {
    imported.dropped.push_back(
        fmt::format("{}: markers are not a motion", fmt::join(markers, ", ")));
  }
  SettleWorld(imported, options, WorldUp::kPlusZ, false);
  return imported;
}

}  // namespace holdfast
