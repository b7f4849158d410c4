// SPDX-License-Identifier: MIT
#include "geometry/import/amass.h"

#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/mano_parameters.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"

namespace holdfast {
namespace {

using Eigen::Index;

constexpr int kSmplhJoints = 52;
constexpr int kSmplJoints = 24;

struct AmassPart {
  const char* name;
  int begin, joints;
  bool needed;
};
constexpr std::array<AmassPart, 5> kParts = {
    {{"pose_body", 1, 21, true},  // first: it determines the order of 6D numbers
     {"root_orient", 0, 1, true},
     {"pose_jaw", 22, 1, false},
     {"pose_eye", 23, 2, false},
     {"pose_hand", kLeftHandBegin, 2 * kJointsPerHand, false}}};

bool HasParts(const Fields& fields) { return fields.Has("root_orient") && fields.Has("pose_body"); }

// Name of the array that holds all joints.
std::string_view JoinedName(const Fields& fields) {
  return fields.Has("poses") ? "poses" : fields.Has("rots") ? "rots" : "fullpose";
}

// The goal of a record of WANDR's training data, as of CIRCLE: goal_frame, target_bone.
std::optional<GoalFrame> ReadGoal(const Fields& fields, Index frames, ImportedClip& imported) {
  const auto frame = fields.Find("goal_frame");
  const auto bone = fields.Find("target_bone");
  if (!frame || !bone) return std::nullopt;
  const std::string name = bone->Text();
  const double number = frame->Number();
  const bool right = name == "RightHand", left = name == "LeftHand";
  if (!right && !left) {
    imported.notes.push_back(
        fmt::format("warning: target_bone is '{}', not RightHand or LeftHand: "
                    "the goal is dropped",
                    name));
    return std::nullopt;
  }
  if (!(number >= 0.0 && number < static_cast<double>(frames))) {
    imported.notes.push_back(
        fmt::format("warning: goal_frame is {:g}, but there are {} frames: the "
                    "goal is dropped",
                    number, frames));
    return std::nullopt;
  }
  imported.conventions.push_back(
      fmt::format("goal of the {} wrist in frame {:g}", right ? "right" : "left", number));
  return GoalFrame{static_cast<int>(number), right ? Side::kRight : Side::kLeft};
}

void ReadConcatenated(const Fields& fields, Index frames, ImportedClip& imported) {
  Clip& clip = imported.clip;
  const DataValue poses = fields[JoinedName(fields)];
  const NpyMember member = poses.Array();
  const auto holds = [&](int joints) {
    return NumbersPerRotation(member, joints, frames).has_value();
  };
  const auto read = [&](int joints) { return ReadRotations(poses, joints, imported, frames); };
  if (holds(kNumJoints)) {
    imported.format = "AMASS, SMPL-X";
    SetJoints(clip.pose, 0, read(kNumJoints), poses.Where());
  } else if (holds(kSmplhJoints)) {
    imported.format = "AMASS, SMPL-H";
    const Eigen::MatrixXd all = read(kSmplhJoints);
    SetJoints(clip.pose, 0, all.topRows(3 * kNumBodyJoints), poses.Where());
    SetJoints(clip.pose, kLeftHandBegin, all.bottomRows(2 * kHandDofs), poses.Where());
    clip.surface_model_type = "smplh";
    imported.conventions.push_back("52 joints of SMPL-H: jaw and eyes at rest");
  } else if (holds(kSmplJoints)) {
    imported.format = "AMASS, SMPL";
    SetJoints(clip.pose, 0, read(kSmplJoints).topRows(3 * kNumBodyJoints), poses.Where());
    clip.surface_model_type = "smpl";
    imported.conventions.push_back("24 joints of SMPL: its two hand joints dropped");
  } else if (holds(kNumBodyJoints)) {
    imported.format = fields.Has("rots") ? "record of WANDR's training data" : "AMASS, body alone";
    SetJoints(clip.pose, 0, read(kNumBodyJoints), poses.Where());
    clip.surface_model_type = "smpl";
    imported.conventions.push_back("22 joints of the body");
  } else {
    throw Error(poses.Where(), fmt::format("has shape {}", member.ShapeText()),
                "Give (frames, 165) of SMPL-X, (frames, 156) of SMPL-H, (frames, 72) of SMPL or "
                "(frames, 66) of a body alone");
  }
}

void ReadParts(const Fields& fields, Index frames, ImportedClip& imported) {
  imported.format = "AMASS, SMPL-X";
  for (const AmassPart& part : kParts) {
    if (!part.needed && !fields.Has(part.name)) continue;
    const DataValue value = fields[part.name];
    SetJoints(imported.clip.pose, part.begin, ReadRotations(value, part.joints, imported, frames),
              value.Where());
  }
}

// Reads an object's or a table's arrays as a clip stores them; nullopt if there are none.
std::optional<ObjectTrack> ReadClipTrack(const Fields& fields, const std::string& thing,
                                         Index frames, ImportedClip& imported) {
  if (!fields.Has(thing + "_trans") || !fields.Has(thing + "_orient")) return std::nullopt;
  ObjectTrack track;
  track.trans = ReadFrameRows(fields[thing + "_trans"], 3);
  track.orient = ReadObjectRotations(fields[thing + "_orient"], imported, frames);
  RequireFrames(fields.Where(), thing + "_trans", track.trans.cols(), frames);
  RequireFrames(fields.Where(), thing + "_orient", track.orient.cols(), frames);
  track.name = TextOf(fields, thing + "_name");
  track.mesh = TextOf(fields, thing + "_mesh");
  return track;
}

// Reads the fields that only Holdfast's clips have.
void ReadClipExtras(const Fields& fields, ImportedClip& imported) {
  Clip& clip = imported.clip;
  const Index frames = clip.trans.cols();
  clip.object = ReadClipTrack(fields, "object", frames, imported);
  clip.table = ReadClipTrack(fields, "table", frames, imported);
  clip.subject = TextOf(fields, "subject");
  clip.action = TextOf(fields, "action");
  clip.body_model = TextOf(fields, "body_model");
  if (TextOf(fields, "surface_model_type").starts_with("mano")) clip.surface_model_type = "mano";
  if (const auto holding = fields.Find("holding_hand")) {
    clip.holding_hand = HoldingHandOf(holding->Array(), frames);
  }
}

// Lists the fields that a clip cannot store and the unknown fields.
void ListUnused(const Fields& fields, bool parts, ImportedClip& imported) {
  const auto used = [&](const std::string& name) {
    static constexpr std::array kUsed = {"trans",
                                         "poses",
                                         "fullpose",
                                         "rots",
                                         "goal_frame",
                                         "target_bone",
                                         "joint_positions",
                                         "fname",
                                         "betas",
                                         "num_betas",
                                         "gender",
                                         "subject",
                                         "action",
                                         "body_model",
                                         "surface_model_type",
                                         "object_trans",
                                         "table_name",
                                         "object_orient",
                                         "object_name",
                                         "object_mesh",
                                         "table_trans",
                                         "table_mesh",
                                         "table_orient",
                                         "holding_hand",
                                         "mocap_time_length",
                                         "stageii_debug_details"};
    return IsFrameRateName(name) || std::ranges::find(kUsed, name) != kUsed.end() ||
           (parts && std::ranges::find(kParts, name, &AmassPart::name) != kParts.end());
  };
  std::vector<std::string> markers, others;
  for (const std::string& name : fields.Names()) {
    if (used(name)) continue;
    if (name == "dmpls") {
      imported.dropped.push_back("dmpls: clips store no soft tissue");
    } else if (name == "expression" || name == "face_expr") {
      imported.dropped.push_back(name + ": clips store no facial expression");
    } else if (name.starts_with("markers") || name.starts_with("labels") ||
               name.starts_with("latent_labels")) {
      markers.push_back(name);
    } else {
      others.push_back(name);
    }
  }
  if (!markers.empty()) {
    imported.dropped.push_back(fmt::format("{}: clips store no markers", fmt::join(markers, ", ")));
  }
  if (!others.empty()) imported.dropped.push_back(fmt::format("{}", fmt::join(others, ", ")));
}

// AMASS is z-up. For a file with only AMASS's field names, up is the axis the body stands along.
UpAxis UpOfNames(const Fields& fields, const ParameterOptions& options, ImportedClip& imported) {
  if (options.up || imported.clip.surface_model_type == "mano") return UpAxis::kZ;
  const std::optional<UpAxis> upright = UprightAxis(imported.clip, *options.body);
  if (!upright || *upright == UpAxis::kZ) return UpAxis::kZ;
  const bool own = fields.Has("mocap_frame_rate") || fields.Has("mocap_framerate");
  imported.notes.push_back(
      own ? fmt::format("warning: the body stands along {0}, but AMASS is z-up: if the file is not "
                        "from AMASS, use 'holdfast import --up={0}'",
                        UpAxisName(*upright))
          : fmt::format("warning: the field names are AMASS's, but the body stands along {}, not "
                        "z: that axis is used as up (--up overrides this)",
                        UpAxisName(*upright)));
  return own ? UpAxis::kZ : *upright;
}

// Whether the fingers keep one pose. In a long clip this means that they were not captured.
bool FingersStand(const Clip& clip) {
  const auto fingers = [&](std::size_t t) { return clip.pose[t].rightCols(2 * kJointsPerHand); };
  for (std::size_t t = 1; t < clip.pose.size(); ++t) {
    if ((fingers(t) - fingers(0)).cwiseAbs().maxCoeff() > 1e-6) return false;
  }
  return true;
}

}  // namespace

bool LooksLikeAmass(const Fields& fields) {
  const bool mosh = fields.Has("fullpose") &&
                    (fields.Has("stageii_debug_details") || fields.Has("markers_latent"));
  return fields.Has("trans") &&
         (fields.Has("poses") || fields.Has("rots") || HasParts(fields) || mosh);
}

bool NeedsImport(const NpzReader& archive) {
  if (!archive.Has("mocap_frame_rate") && !archive.Has("mocap_framerate")) return true;
  // Whether ReadClip rejects a form that ReadRotations accepts.
  const auto other_form = [&](const char* name, int joints) {
    if (!archive.Has(name)) return false;
    const NpyMember member = archive.Read(name);
    const std::vector<std::size_t>& shape = member.array.shape;
    const bool plain = shape.size() == 2 && shape[1] == static_cast<std::size_t>(3 * joints);
    return !plain && NumbersPerRotation(member, joints).has_value();
  };
  const bool joined = !archive.Has("root_orient");
  if (joined && other_form("poses", kNumJoints)) return true;
  for (const AmassPart& part : kParts) {
    if (!joined && other_form(part.name, part.joints)) return true;
  }
  if (other_form("object_orient", 1) || other_form("table_orient", 1)) return true;
  if (!archive.Has("betas")) return false;
  const std::vector<std::size_t> shape = archive.Read("betas").array.shape;
  return shape.size() > 1 && shape[0] > 1;
}

ImportedClip ImportAmass(const Fields& fields, const std::filesystem::path& path,
                         const ParameterOptions& options) {
  ImportedClip imported;
  Clip& clip = imported.clip;
  clip.trans = ReadFrameRows(fields["trans"], 3);
  const Index frames = clip.trans.cols();
  const bool parts = HasParts(fields);
  clip.pose = RestPoses(frames, fields[parts ? "pose_body" : JoinedName(fields)], 63);
  SettleFrameRate(fields, options, 30, imported);
  if (parts) {
    ReadParts(fields, frames, imported);
  } else {
    ReadConcatenated(fields, frames, imported);
  }
  if (fields.Has("stageii_debug_details")) imported.format += " (MoSh++)";
  const bool has_fingers =
      clip.surface_model_type == "smplh" || (parts ? fields.Has("pose_hand") : true);
  if (clip.surface_model_type != "smpl" && has_fingers) {
    imported.conventions.push_back("finger angles are complete (AMASS adds no mean hand)");
    if (options.flat_hand_mean == false) {
      for (JointPose& pose : clip.pose) pose = AddHandMean(*options.body, pose);
      imported.conventions.back() =
          "finger angles are taken as differences from the mean hand, which was added";
    } else if (FingersLookFlat(clip, *options.body) == false) {
      imported.notes.push_back(
          "finger angles at rest are near zero, not near the mean hand: they may be relative to "
          "the mean hand (if so, use --flat-hand-mean no)");
    }
    if (frames > 1 && FingersStand(clip)) {
      imported.notes.push_back("the fingers never move: they were not captured");
    }
  }
  if (clip.surface_model_type == "smpl") {
    for (JointPose& pose : clip.pose) pose = AddHandMean(*options.body, pose);
    imported.notes.push_back(
        fmt::format("SMPL has no fingers: the relaxed hand of {} is used", options.body->Name()));
  }
  if (const auto betas = fields.Find("betas"); betas && betas->HoldsNumbers()) {
    SetBetas(ReadBetas(*betas), imported);
  }
  constexpr std::array<std::string_view, 1> kGender = {"gender"};
  if (const auto gender = FindBelow(fields, kGender, fields.Has("stageii_debug_details") ? 3 : 0)) {
    clip.gender = GenderOf(*gender).value_or("neutral");
  }
  ReadClipExtras(fields, imported);
  imported.goal = ReadGoal(fields, frames, imported);
  ListUnused(fields, parts, imported);
  if (!clip.object) AddObjectBeside(path, options, imported);
  SettleWorld(imported, options, UpOfNames(fields, options, imported), false);
  return imported;
}

}  // namespace holdfast
