// SPDX-License-Identifier: MIT
#include "geometry/import/joint_fields.h"

#include <algorithm>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/rotation_arrays.h"

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
    pose[static_cast<std::size_t>(t)].middleCols(begin, joints) =
        rotations.col(rotations.cols() == 1 ? 0 : t).reshaped(3, joints);
  }
}

void RequireFrames(std::string_view where, std::string_view name, Eigen::Index found,
                   Eigen::Index frames) {
  if (found == frames) return;
  throw Error(fmt::format("{}[{}]", where, name),
              fmt::format("has {} frames where the body has {}", found, frames),
              "All motion arrays of a file have the same length: cut the longer ones");
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

}  // namespace holdfast
