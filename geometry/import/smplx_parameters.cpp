// SPDX-License-Identifier: MIT
#include "geometry/import/smplx_parameters.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/mano_parameters.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/world_frame.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Index;
using Names = std::span<const std::string_view>;

// Each parameter with all names in use for it.
constexpr std::array<std::string_view, 7> kRoot = {
    "global_orient", "root_orient", "smplx_root_pose", "smplx_global_orient",
    "global_pose",   "root_pose",   "poses_root"};
constexpr std::array<std::string_view, 4> kBody = {"body_pose", "pose_body", "smplx_body_pose",
                                                   "poses_body"};
constexpr std::array<std::string_view, 4> kLeftHand = {"left_hand_pose", "lhand_pose",
                                                       "smplx_lhand_pose", "smplx_left_hand_pose"};
constexpr std::array<std::string_view, 4> kRightHand = {
    "right_hand_pose", "rhand_pose", "smplx_rhand_pose", "smplx_right_hand_pose"};
constexpr std::array<std::string_view, 3> kBothHands = {"pose_hand", "poses_hand",
                                                        "hand_pose"};  // ParaHome's
constexpr std::array<std::string_view, 3> kJawNames = {"jaw_pose", "pose_jaw", "smplx_jaw_pose"};
constexpr std::array<std::string_view, 2> kLeftEyeNames = {"leye_pose", "smplx_leye_pose"};
constexpr std::array<std::string_view, 2> kRightEyeNames = {"reye_pose", "smplx_reye_pose"};
constexpr std::array<std::string_view, 1> kBothEyesNames = {"pose_eye"};
constexpr std::array<std::string_view, 8> kTrans = {
    "trans_world",  // WHAM's, beside that in the camera's frame
    "transl",      "trans",      "smplx_transl", "cam_trans",
    "translation", "root_trans", "global_transl"};
constexpr std::array<std::string_view, 6> kBetas = {"betas",       "shape", "smplx_shape",
                                                    "smplx_betas", "beta",  "shapes"};
constexpr std::array<std::string_view, 4> kFull = {"fullpose", "full_pose", "smplx_fullpose",
                                                   "pose_world"};
// EasyMocap: a rotation about the origin and a translation, outside of the model.
constexpr std::string_view kEasyTurn = "Rh", kEasyPlace = "Th", kEasyPose = "poses";
constexpr std::array<std::string_view, 3> kEasy = {kEasyTurn, kEasyPlace, kEasyPose};
constexpr std::array<std::string_view, 4> kExpression = {"expression", "exp", "smplx_expr",
                                                         "face_expr"};
constexpr std::array<std::string_view, 5> kFrameRate = {"mocap_frame_rate", "mocap_framerate",
                                                        "frame_rate", "framerate", "fps"};
constexpr std::array<std::string_view, 9> kInside = {"smplx",
                                                     "smplx_params",
                                                     "params",
                                                     "body_params",
                                                     "pred_smplx_params",
                                                     "smplx_param",
                                                     "body",
                                                     "smpl_params_global",  // GVHMR's, in the world
                                                     "results"};            // ROMP's

constexpr int kVposerLatent = 32;
constexpr int kSmplBodyJoints = 23;
constexpr int kSmplNumbers = 3 * (1 + kSmplBodyJoints);

// Concatenates columns; each part is copied only once.
Eigen::MatrixXd Joined(const std::vector<Eigen::MatrixXd>& parts) {
  Index columns = 0;
  for (const Eigen::MatrixXd& part : parts) columns += part.cols();
  Eigen::MatrixXd all(parts.empty() ? 0 : parts[0].rows(), columns);
  columns = 0;
  for (const Eigen::MatrixXd& part : parts) {
    all.middleCols(columns, part.cols()) = part;
    columns += part.cols();
  }
  return all;
}

void NoteAssumedRate(ImportedClip& imported) {
  imported.notes.push_back(fmt::format(
      "warning: no frame rate in the file: assuming {:g} Hz (--source-fps overrides this)",
      imported.clip.frame_rate));
}

bool IsEasyMocap(const Fields& fields) {
  return fields.Has(kEasyTurn) && fields.Has(kEasyPlace) && fields.Has(kEasyPose);
}

bool HasParameters(const Fields& fields) {
  if (IsEasyMocap(fields)) {
    const DataValue pose = fields[kEasyPose];
    if (!pose.HoldsNumbers()) return false;
    const std::vector<std::size_t> shape = pose.Array().array.shape;
    return !shape.empty() && shape.back() == kSmplNumbers;
  }
  return (fields.FirstOf(kBody) && fields.FirstOf(kRoot)) ||
         (fields.FirstOf(kFull) && fields.FirstOf(kTrans));
}

// Finds the dict of parameters in a value that packs it: the value itself, one person of a list, or
// a dict below a name such as `smplx` or `params`. nullopt if there is none.
std::optional<Fields> FindParameters(const Fields& fields) {
  if (HasParameters(fields)) return fields;
  for (const std::string_view name : kInside) {
    if (!fields.Has(name)) continue;
    const Fields inside = fields.In(name);
    if (HasParameters(inside)) return inside;
  }
  return std::nullopt;
}

// Frame rate in Hz under any of its common names, in `fields` or in a dict below (MoSh++ has it in
// stageii_debug_details); nullopt if there is none. Throws Error for a rate that is not positive.
std::optional<double> FrameRateOf(const Fields& fields) {
  constexpr int kDepth = 3;
  const auto rate = FindBelow(fields, kFrameRate, kDepth);
  if (!rate) return std::nullopt;
  std::vector<double> values;
  if (rate->HoldsNumbers()) {
    values = rate->Array().AsDoubles();
  } else if (rate->Kind() == DataKind::kText) {
    double number = 0;
    if (ParseNumber(rate->Text(), number)) values = {number};
  }
  const bool one = !values.empty() &&
                   std::ranges::all_of(values, [&](double value) { return value == values[0]; });
  if (!one || !(values[0] > 0) || !std::isfinite(values[0])) {
    throw Error(rate->Where(),
                one ? fmt::format("is {}", values[0]) : std::string("is not one number"),
                "Give frames per second");
  }
  return values[0];
}

}  // namespace

bool LooksLikeParameters(const Fields& fields) { return FindParameters(fields).has_value(); }

std::optional<DataValue> FindBelow(const Fields& fields, Names names, int depth) {
  if (const auto found = fields.Find(names)) return found;
  if (depth == 0) return std::nullopt;
  for (const std::string& name : fields.Names()) {
    try {
      const DataValue value = fields[name];
      if (value.Kind() != DataKind::kDict) continue;
      if (const auto found = FindBelow(Fields(value), names, depth - 1)) return found;
    } catch (const Error&) {
      continue;  // no other code asks for this field, so it may hold unreadable data
    }
  }
  return std::nullopt;
}

bool IsFrameRateName(std::string_view name) {
  return std::ranges::find(kFrameRate, name) != kFrameRate.end();
}

void SettleFrameRate(const Fields& fields, const ParameterOptions& options, double assumed,
                     ImportedClip& imported) {
  Clip& clip = imported.clip;
  if (const auto rate = FrameRateOf(fields)) {
    clip.frame_rate = *rate;
    return;
  }
  if (options.source_frame_rate) {
    clip.frame_rate = *options.source_frame_rate;
    return;
  }
  clip.frame_rate = assumed;
  if (clip.NumFrames() < 2) return;
  if (const auto length = fields.Find("mocap_time_length"); length && length->HoldsNumbers()) {
    const double seconds = length->Number();
    if (seconds > 0 && std::isfinite(seconds)) {
      const double rate = clip.NumFrames() / seconds, whole = std::round(rate);
      clip.frame_rate = std::abs(rate - whole) < 0.01 * whole ? whole : rate;
      imported.notes.push_back(fmt::format(
          "no frame rate in the file: {:g} Hz computed from mocap_time_length", clip.frame_rate));
      return;
    }
  }
  NoteAssumedRate(imported);
}

std::optional<bool> FlatHandMeanOf(const Fields& fields) {
  const auto flat = fields.Find("flat_hand_mean");
  if (!flat || !flat->HoldsNumbers()) return std::nullopt;
  return flat->Number() != 0;
}

ParameterCollector::ParameterCollector(const ParameterOptions& options)
    : options_(options), fingers_(options) {
  imported_.format = "SMPL-X parameters";
  imported_.clip.frame_rate = options.source_frame_rate.value_or(0.0);
}

Eigen::MatrixXd ParameterCollector::ReadBody(const DataValue& value, Index frames) {
  const NpyMember member = value.Array();
  const std::size_t size = member.array.NumElements();
  const std::size_t last = member.array.shape.empty() ? 0 : member.array.shape.back();
  if (last == kVposerLatent || (size == kVposerLatent && member.array.shape.size() == 1)) {
    throw Error(value.Where(),
                "holds the 32 numbers of VPoser's latent space, not joint angles (SMPLify-X's "
                "use_vposer)",
                "Decode it with VPoser where the file was made and save body_pose as (1, 63)");
  }
  const bool smpl = !NumbersPerRotation(member, kNumBodyJoints - 1, frames) &&
                    NumbersPerRotation(member, kSmplBodyJoints, frames);
  if (!smpl) return ReadRotations(value, kNumBodyJoints - 1, imported_, frames);
  is_smpl_ = true;
  return ReadRotations(value, kSmplBodyJoints, imported_, frames).topRows(3 * (kNumBodyJoints - 1));
}

void ParameterCollector::AddHands(const Fields& fields, std::vector<JointPose>& pose) {
  if (options_.hands == ImportedHands::kNone) return;
  const auto frames = static_cast<Index>(pose.size());
  if (const auto both = fields.Find(kBothHands)) {
    // 30 joints: left hand, then right hand, as angles (the layout of AMASS).
    SetJoints(pose, kLeftHandBegin, ReadRotations(*both, 2 * kJointsPerHand, imported_, frames),
              both->Where());
    has_fingers_ = true;
  }
  for (const auto& [side, names] :
       {std::pair<Side, Names>{Side::kLeft, kLeftHand}, {Side::kRight, kRightHand}}) {
    const auto hand = fields.Find(names);
    if (!hand) continue;
    SetJoints(pose, HandBegin(side), fingers_.Read(*hand, side, imported_, frames), hand->Where());
    has_fingers_ = true;
  }
}

void ParameterCollector::AddBetas(const Fields& fields) {
  const auto value = fields.Find(kBetas);
  if (!value || !value->HoldsNumbers()) return;
  Eigen::MatrixXd rows = ReadBetas(*value);
  if (rows.cols() > 0) betas_.push_back(std::move(rows));
}

void ParameterCollector::AddTrans(const Fields& fields, Index frames) {
  const auto trans = fields.Find(kTrans);
  if (!trans) {
    trans_.push_back(Eigen::MatrixXd::Zero(3, frames));
    frames_without_trans_ += static_cast<int>(frames);
    return;
  }
  Eigen::MatrixXd rows = ReadFrameRows(*trans, 3);
  if (rows.cols() == 1 && frames > 1) rows = rows.replicate(1, frames).eval();
  RequireFrames(fields.Where(), *fields.FirstOf(kTrans), rows.cols(), frames);
  trans_.push_back(std::move(rows));
}

// x = Rh v + Th, of vertices posed by the model: about the origin, not about the pelvis.
void ParameterCollector::AddEasyMocap(const Fields& fields, std::vector<JointPose>& pose) {
  is_smpl_ = true;
  const DataValue value = fields[kEasyPose];
  const Eigen::MatrixXd rows = ReadFrameRows(value, kSmplNumbers);
  const Index frames = rows.cols();
  const Eigen::MatrixXd turns = ReadRotations(fields[kEasyTurn], 1, imported_, frames);
  Eigen::MatrixXd places = ReadFrameRows(fields[kEasyPlace], 3);
  RequireFrames(fields.Where(), kEasyTurn, turns.cols(), frames);
  RequireFrames(fields.Where(), kEasyPlace, places.cols(), frames);
  pose = RestPoses(frames, value, 3 * kNumBodyJoints);
  SetJoints(pose, 0, rows.topRows(3 * kNumBodyJoints), value.Where());
  for (Index t = 0; t < frames; ++t) {
    const Eigen::Matrix3d turn = ExpSO3(turns.col(t));
    pose[t].col(0) = LogSO3(turn * ExpSO3(pose[t].col(0)));
    places.col(t) += turn * kSmplhRestPelvis - kSmplhRestPelvis;
  }
  trans_.push_back(std::move(places));
}

void ParameterCollector::Add(const Fields& packed) {
  const std::optional<Fields> found = FindParameters(packed);
  if (!found) {
    throw Error(packed.Where(), "holds no body parameters",
                fmt::format("Give a root ({}, ...) and a body ({}, ...); it has: {}", kRoot[0],
                            kBody[0], fmt::join(packed.Names(), ", ")));
  }
  const Fields& fields = *found;
  std::vector<JointPose> pose;
  const auto full = fields.Find(kFull);
  const auto root = fields.Find(kRoot);
  const auto body = fields.Find(kBody);
  const bool easymocap = !(body && root) && IsEasyMocap(fields);
  // Number of frames that decides between two readings of a shape.
  Index told = 0;
  if (const auto trans = fields.Find(kTrans)) told = ReadFrameRows(*trans, 3).cols();
  if (body && root) {
    const Eigen::MatrixXd body_rows = ReadBody(*body, told);
    if (told <= 1) told = body_rows.cols();
    const Eigen::MatrixXd root_rows = ReadRotations(*root, 1, imported_, told);
    const Index frames = std::max(root_rows.cols(), body_rows.cols());
    pose = RestPoses(frames, *body, 3 * (kNumBodyJoints - 1));
    SetJoints(pose, 0, root_rows, root->Where());
    SetJoints(pose, 1, body_rows, body->Where());
    for (const auto& [names, begin, joints] : {std::tuple<Names, int, int>{kJawNames, 22, 1},
                                               {kBothEyesNames, 23, 2},
                                               {kLeftEyeNames, 23, 1},
                                               {kRightEyeNames, 24, 1}}) {
      if (const auto value = fields.Find(names)) {
        SetJoints(pose, begin, ReadRotations(*value, joints, imported_, frames), value->Where());
      }
    }
    AddHands(fields, pose);
  } else if (easymocap) {
    AddEasyMocap(fields, pose);
  } else if (const auto smpl = full->Array(); !NumbersPerRotation(smpl, kNumJoints, told) &&
                                              NumbersPerRotation(smpl, 1 + kSmplBodyJoints, told)) {
    is_smpl_ = true;
    const Eigen::MatrixXd rows = ReadRotations(*full, 1 + kSmplBodyJoints, imported_, told);
    pose = RestPoses(rows.cols(), *full, 3 * kNumBodyJoints);
    SetJoints(pose, 0, rows.topRows(3 * kNumBodyJoints), full->Where());
  } else {
    const Eigen::MatrixXd rows = ReadRotations(*full, kNumJoints, imported_, told);
    pose.assign(static_cast<std::size_t>(rows.cols()), JointPose::Zero());
    SetJoints(pose, 0, rows, full->Where());
    has_fingers_ = options_.hands != ImportedHands::kNone;
    if (!has_fingers_) {
      for (JointPose& p : pose) p.rightCols(2 * kJointsPerHand).setZero();
    }
  }
  if (!easymocap) AddTrans(fields, static_cast<Index>(pose.size()));
  Clip& clip = imported_.clip;
  clip.pose.insert(clip.pose.end(), pose.begin(), pose.end());
  if (clip.NumFrames() > kMaxImportFrames) {
    throw Error(fields.Where(), "has more than two million frames", "Cut it into clips");
  }
  AddBetas(fields);
  if (const auto gender = fields.Find("gender")) {
    if (const auto known = GenderOf(*gender)) clip.gender = *known;
  }
  if (const auto rate = FrameRateOf(packed)) clip.frame_rate = *rate;
  ListDropped(packed, fields);
}

void ParameterCollector::ListDropped(const Fields& packed, const Fields& fields) {
  if (!imported_.dropped.empty()) return;  // the first part stands for all
  std::vector<std::string> cameras, others;
  const auto known = [&](const std::string& name) {
    for (const Names names :
         {Names(kRoot), Names(kBody), Names(kLeftHand), Names(kRightHand), Names(kBothHands),
          Names(kJawNames), Names(kLeftEyeNames), Names(kRightEyeNames), Names(kBothEyesNames),
          Names(kTrans), Names(kBetas), Names(kFull), Names(kFrameRate), Names(kEasy)}) {
      if (std::ranges::find(names, name) != names.end()) return true;
    }
    return name == "gender" || name == "flat_hand_mean";
  };
  std::vector<std::string> names = fields.Names();
  if (fields.Where() != packed.Where()) {
    for (const std::string& name : packed.Names()) {
      if (std::ranges::find(kInside, name) == kInside.end()) names.push_back(name);
    }
  }
  for (const std::string& name : names) {
    if (known(name)) continue;
    if (std::ranges::find(kExpression, name) != kExpression.end()) {
      imported_.dropped.push_back(name + ": clips store no facial expression");
    } else if (name.starts_with("cam") || name.ends_with("_cam") || name.starts_with("focal") ||
               name.starts_with("pred_cam")) {
      cameras.push_back(name);
    } else {
      others.push_back(name);
    }
  }
  if (!cameras.empty()) {
    imported_.dropped.push_back(fmt::format("{}: clips store no camera", fmt::join(cameras, ", ")));
  }
  if (!others.empty()) imported_.dropped.push_back(fmt::format("{}", fmt::join(others, ", ")));
}

void ParameterCollector::DecideFlat(std::optional<bool> known_flat) {
  Clip& clip = imported_.clip;
  if (!has_fingers_) {
    for (JointPose& pose : clip.pose) pose = AddHandMean(*options_.body, pose);
    imported_.notes.push_back(fmt::format(
        "fingers are not imported: the relaxed hand of {} is used", options_.body->Name()));
    return;
  }
  if (!fingers_.MayLackMean()) return;
  bool flat = false;  // the smplx package's default, also of SMPLify-X
  if (options_.flat_hand_mean) {
    flat = *options_.flat_hand_mean;
  } else if (known_flat) {
    flat = *known_flat;
  } else if (fingers_.HasCoefficients()) {
    imported_.notes.push_back(
        "hand coefficients are assumed to be on top of the mean hand, the smplx package's default "
        "(--flat-hand-mean yes overrides this)");
  } else if (const auto looks = FingersLookFlat(clip, *options_.body)) {
    flat = *looks;
    imported_.notes.push_back(fmt::format(
        "the file does not state whether finger angles are complete; relaxed fingers are near {}, "
        "so they are taken as {} (--flat-hand-mean overrides this)",
        flat ? "the mean hand" : "zero", flat ? "complete" : "differences from the mean hand"));
  } else {
    imported_.notes.push_back(
        "the file does not state whether finger angles are complete: taken as differences from the "
        "mean hand, the smplx package's default (--flat-hand-mean yes overrides this)");
  }
  if (!flat) fingers_.AddMean(clip.pose);
}

void ParameterCollector::DecideBetas() {
  if (betas_.empty()) return;
  const bool same_count = std::ranges::all_of(
      betas_, [&](const Eigen::MatrixXd& part) { return part.rows() == betas_[0].rows(); });
  if (!same_count) {
    imported_.notes.push_back("betas have different lengths: ignored, the mean shape is used");
  } else if (is_smpl_) {
    imported_.notes.push_back("betas are SMPL's, which do not apply to SMPL-X: ignored");
  } else {
    SetBetas(Joined(betas_), imported_);
  }
}

ImportedClip ParameterCollector::Collect(std::optional<bool> known_flat) {
  Clip& clip = imported_.clip;
  clip.trans = Joined(trans_);
  if (clip.frame_rate == 0) {
    clip.frame_rate = 30;
    if (clip.NumFrames() > 1) NoteAssumedRate(imported_);
  }
  if (frames_without_trans_ > 0) {
    imported_.notes.push_back(fmt::format("no translation in {} of {} frames: zero is used there",
                                          frames_without_trans_, clip.NumFrames()));
  }
  if (is_smpl_) {
    clip.surface_model_type = "smpl";
    imported_.conventions.push_back("24 joints of SMPL: its two hand joints dropped");
  }
  DecideFlat(known_flat);
  DecideBetas();
  Append(imported_.conventions, fingers_.Conventions());
  Append(imported_.notes, fingers_.Notes());
  if (imported_.body_defects.matrices > 0) {
    imported_.conventions.push_back("rotations are matrices or 6D, converted to axis-angle");
  }
  return std::move(imported_);
}

ImportedClip ImportParameters(const Fields& fields, const std::filesystem::path& path,
                              const ParameterOptions& options) {
  ParameterCollector collector(options);
  collector.Add(fields);
  ImportedClip imported = collector.Collect(FlatHandMeanOf(fields));
  AddObjectBeside(path, options, imported);
  SettleWorld(imported, options, {}, true);
  return imported;
}

}  // namespace holdfast
