// SPDX-License-Identifier: MIT
#include "geometry/import/joint_fields.h"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/world_frame.h"

namespace holdfast {

std::vector<JointPose> RestPoses(Eigen::Index frames, const DataValue& main, Eigen::Index numbers) {
  const NpyMember member = main.Array();
  if (member.array.NumElements() / static_cast<std::size_t>(numbers) <
      static_cast<std::size_t>(frames)) {
    throw Error(main.Where(),
                fmt::format("has shape {}, too few numbers for the {} frames of the motion",
                            member.ShapeText(), frames),
                "All motion arrays have the same length");
  }
  return std::vector<JointPose>(static_cast<std::size_t>(frames), JointPose::Zero());
}

void SetJoints(std::vector<JointPose>& pose, int begin, const Eigen::MatrixXd& rotations,
               std::string_view where) {
  const auto frames = static_cast<Eigen::Index>(pose.size());
  if (rotations.cols() != frames && rotations.cols() != 1) {
    throw Error(where,
                fmt::format("has {} frames where the motion has {}", rotations.cols(), frames),
                "All motion arrays have the same length");
  }
  const Eigen::Index joints = rotations.rows() / 3;
  for (Eigen::Index t = 0; t < frames; ++t) {
    pose[t].middleCols(begin, joints) =
        rotations.col(rotations.cols() == 1 ? 0 : t).reshaped(3, joints);
  }
}

void ReadBodyJoints(const Fields& params, bool needs_face, ImportedClip& imported) {
  const auto frames = static_cast<Eigen::Index>(imported.clip.pose.size());
  for (const auto& [name, begin, joints] : {std::tuple{"global_orient", 0, 1},
                                            {"body_pose", 1, 21},
                                            {"jaw_pose", 22, 1},
                                            {"leye_pose", 23, 1},
                                            {"reye_pose", 24, 1}}) {
    if (begin >= kNumBodyJoints && !needs_face && !params.Has(name)) continue;
    const DataValue value = params[name];
    SetJoints(imported.clip.pose, begin, ReadRotations(value, joints, imported, frames),
              value.Where());
  }
}

void RequireFrames(std::string_view where, std::string_view name, Eigen::Index found,
                   Eigen::Index frames) {
  if (found == frames) return;
  throw Error(fmt::format("{}[{}]", where, name),
              fmt::format("has {} frames where the body has {}", found, frames),
              "All motion arrays of a file have the same length: cut the longer ones");
}

ObjectTrack ReadRowTrack(const Fields& params, Eigen::Index frames, ImportedClip& imported) {
  ObjectTrack track;
  track.trans = ReadFrameRows(params["transl"], 3);
  // Row vectors: v R(w) + t = R(w)^T v + t = R(-w) v + t, also for the nearest rotation.
  track.orient = -ReadObjectRotations(params["global_orient"], imported, frames);
  RequireFrames(params.Where(), "transl", track.trans.cols(), frames);
  RequireFrames(params.Where(), "global_orient", track.orient.cols(), frames);
  return track;
}

Eigen::MatrixXd ReadBetas(const DataValue& value) {
  std::vector<std::size_t> shape = value.Array().array.shape;
  std::erase(shape, std::size_t{1});
  const auto count = static_cast<Eigen::Index>(shape.empty() ? 1 : shape.back());
  if (std::ranges::find(shape, std::size_t{0}) != shape.end()) return Eigen::MatrixXd(0, 0);
  return ReadFrameRows(value, count);
}

void SetBetas(const Eigen::MatrixXd& betas, ImportedClip& imported) {
  if (betas.cols() == 0) return;
  const Eigen::VectorXd mean = betas.rowwise().mean();
  const double spread = (betas.colwise() - mean).cwiseAbs().maxCoeff();
  const bool same = (betas.colwise() - betas.col(0)).isZero(0.0);
  imported.clip.betas = same ? Eigen::VectorXd(betas.col(0)) : mean;
  if (spread > 1e-6) {
    imported.notes.push_back(fmt::format(
        "betas differ from frame to frame (by up to {:.3g}): their mean is the clip's shape",
        spread));
  }
}

void Append(std::vector<std::string>& texts, std::vector<std::string> more) {
  for (std::string& text : more) texts.push_back(std::move(text));
}

namespace {

using Eigen::Index;

// Offsets in a row of Motion-X.
constexpr Index kMotionX = 322, kHandsAt = 66, kJawAt = 156, kExpressionAt = 159, kTransAt = 309,
                kBetasAt = 312, kNumBetas = 10;
constexpr double kMotionXFrameRate = 30;
constexpr int kArraySmplhJoints = 52;

[[noreturn]] void Refuse(const DataValue& value, const NpyMember& member, Index width) {
  const char* problem = "not a known layout of body parameters without names";
  const char* remedy =
      "Give (frames, 322) of Motion-X, (frames, 165) of SMPL-X, (frames, 156) of SMPL-H, or "
      "arrays with names in a .npz";
  if (width == 263 || width == 251) {
    problem =
        "features of HumanML3D (263) or KIT-ML (251), which hold no rotations of SMPL-X's joints";
    remedy =
        "Give the AMASS file that they were made from, or joints fitted by an inverse-kinematics "
        "code";
  } else if (width == 623) {
    problem = "features of HumanTOMATO, which hold no rotations of SMPL-X's joints";
    remedy = "Give the Motion-X file (frames, 322) that they were made from";
  } else if (width == 7) {
    problem = "an object of ARCTIC: articulation, rotation, translation";
    remedy = "Give the .smplx.npy beside it: the object is imported with it";
  } else if (member.array.shape.size() == 3 && width == 3) {
    problem = "positions of joints, not rotations";
    remedy = "Fit a body to them first";
  }
  throw Error(value.Where(), fmt::format("has shape {}: {}", member.ShapeText(), problem), remedy);
}

}  // namespace

ImportedClip ImportParameterArray(const DataValue& value, const ParameterOptions& options) {
  const NpyMember member = value.Array();
  const std::vector<std::size_t>& shape = member.array.shape;
  const Index width = shape.empty() ? 0 : static_cast<Index>(shape.back());
  const bool smplx = NumbersPerRotation(member, kNumJoints).has_value();
  // (T, 52, 3) may also be positions.
  const bool smplh = !smplx && !(shape.size() == 3 && width == 3) &&
                     NumbersPerRotation(member, kArraySmplhJoints).has_value();
  if (width != kMotionX && !smplh && !smplx) Refuse(value, member, width);

  ImportedClip imported;
  Clip& clip = imported.clip;
  const double rate = options.source_frame_rate.value_or(kMotionXFrameRate);
  clip.frame_rate = rate;
  std::optional<UpAxis> up;
  if (width == kMotionX) {
    imported.format = "Motion-X";
    const Eigen::MatrixXd rows = ReadFrameRows(value, kMotionX);
    clip.trans = rows.middleRows(kTransAt, 3);
    clip.pose.assign(static_cast<std::size_t>(rows.cols()), JointPose::Zero());
    SetJoints(clip.pose, 0, rows.topRows(kHandsAt), value.Where());
    SetJoints(clip.pose, kLeftHandBegin, rows.middleRows(kHandsAt, 2 * kHandDofs), value.Where());
    SetJoints(clip.pose, 22, rows.middleRows(kJawAt, 3), value.Where());
    SetBetas(rows.middleRows(kBetasAt, kNumBetas), imported);
    imported.conventions.push_back("finger angles are complete");
    if (!options.source_frame_rate) {
      imported.notes.push_back(
          fmt::format("no frame rate in the file: assuming Motion-X's {:g} Hz", rate));
    }
    if (!rows.middleRows(kExpressionAt, kTransAt - kExpressionAt).isZero(0.0)) {
      imported.dropped.push_back("expression and face shape: clips store neither");
    }
    up = UpAxis::kY;
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
        fmt::format("warning: the array holds poses only: no translation, and {:g} Hz is assumed "
                    "(--source-fps overrides this)",
                    rate));
    imported.conventions.push_back("finger angles are assumed to be complete");
  }
  if (options.flat_hand_mean == false) {
    for (JointPose& pose : clip.pose) pose = AddHandMean(*options.body, pose);
    imported.conventions.push_back("the mean hand was added to the fingers, as requested");
  }
  SettleWorld(imported, options, up, true);
  return imported;
}

}  // namespace holdfast
