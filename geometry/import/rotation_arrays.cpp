// SPDX-License-Identifier: MIT
#include "geometry/import/rotation_arrays.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Index;

Index SizeOf(const NpyMember& member) { return static_cast<Index>(member.array.NumElements()); }

// Lengths without those of one, and never none.
std::vector<Index> TrueShape(const NpyMember& member) {
  std::vector<Index> shape;
  for (const std::size_t n : member.array.shape) {
    if (n != 1) shape.push_back(static_cast<Index>(n));
  }
  if (shape.empty()) shape.push_back(1);
  return shape;
}

// Values as (per_frame x frames), finite.
Eigen::MatrixXd FiniteColumns(const NpyMember& member, Index per_frame) {
  const Index frames = SizeOf(member) / per_frame;
  if (frames == 0) throw Error(member.where, "has no frames", "Give at least one frame");
  if (frames > kMaxImportFrames) {
    throw Error(member.where, fmt::format("has {} frames", frames), "Cut it into clips");
  }
  const std::vector<double> values = member.AsDoubles();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      throw Error(member.where,
                  fmt::format("holds {} in frame {}", values[i], static_cast<Index>(i) / per_frame),
                  "Give finite numbers: cut such frames out or fill them in");
    }
  }
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), per_frame, frames);
}

// Whether the lengths from `axis` on are these.
bool EndsWith(const std::vector<Index>& shape, std::initializer_list<Index> end) {
  return shape.size() >= end.size() &&
         std::equal(end.begin(), end.end(), shape.end() - static_cast<std::ptrdiff_t>(end.size()));
}

// What a wrong array probably is.
std::string Guess(const std::vector<Index>& shape, int joints) {
  const auto per_joint = [&](Index n) {
    return EndsWith(shape, {n * joints}) || EndsWith(shape, {joints, n}) ||
           (joints == 1 && EndsWith(shape, {n}));
  };
  if (per_joint(4)) return ": quaternions, whose order the file does not tell";
  if (per_joint(6)) return ": 6D rotations, by rows or by columns the file does not tell";
  return "";
}

bool IsRotation(const Eigen::Matrix3d& M) {
  return (M.transpose() * M - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3;
}

Eigen::Vector3d AxisAngleOf(const Eigen::Matrix3d& M, Index frame, RotationDefects& defects) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M);
  const Eigen::Vector3d singular = svd.singularValues();
  const double determinant = M.determinant();
  const double off = std::max(std::abs(singular[0] - 1), std::abs(singular[2] - 1));
  ++defects.matrices;
  defects.min_singular = std::min(defects.min_singular, singular[2]);
  defects.max_singular = std::max(defects.max_singular, singular[0]);
  defects.min_determinant = std::min(defects.min_determinant, determinant);
  defects.max_determinant = std::max(defects.max_determinant, determinant);
  if (determinant < 0) ++defects.reflections;
  if (off > defects.largest_off) {
    defects.largest_off = off;
    defects.worst_frame = static_cast<int>(frame);
  }
  if (off > kRotationTolerance || determinant < 0) ++defects.bad;
  return LogSO3(NearestRotation(M));
}

}  // namespace

Eigen::MatrixXd ReadFrameRows(const DataValue& value, Index columns) {
  const NpyMember member = value.Array();
  const std::vector<Index> shape = TrueShape(member);
  const bool one_row = shape.size() == 1 && shape[0] == columns;
  const bool rows = shape.size() == 2 && shape[1] == columns;
  // One number a frame may come as (T).
  const bool numbers = columns == 1 && shape.size() == 1;
  if (!one_row && !rows && !numbers) {
    throw Error(member.where, fmt::format("has shape {}", member.ShapeText()),
                fmt::format("Give (frames, {})", columns));
  }
  return FiniteColumns(member, columns);
}

bool HoldsMatrices(const NpyMember& member, int joints) {
  const std::vector<Index> shape = TrueShape(member);
  const Index size = SizeOf(member);
  if (size == 0 || size % (9 * joints) != 0) return false;
  const std::vector<std::size_t>& whole = member.array.shape;
  if (whole.size() >= 2 && whole.back() == 3 && whole[whole.size() - 2] == 3) {
    // (3,3) of one joint: one matrix, or three frames of axis-angle.
    if (joints == 1 && whole.size() == 2) {
      const std::vector<double> values = member.AsDoubles();
      return IsRotation(
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data()));
    }
    return joints == 1 || shape.size() == 4 || (shape.size() == 3 && shape[0] == joints);
  }
  if (joints == 1) return EndsWith(shape, {9});
  return EndsWith(shape, {joints, 9}) || EndsWith(shape, {9 * joints});
}

Eigen::MatrixXd ReadRotations(const DataValue& value, int joints, RotationDefects& defects) {
  const NpyMember member = value.Array();
  if (HoldsMatrices(member, joints)) {
    const Eigen::MatrixXd numbers = FiniteColumns(member, 9 * joints);
    Eigen::MatrixXd axis_angle(3 * joints, numbers.cols());
    for (Index t = 0; t < numbers.cols(); ++t) {
      const int bad_before = defects.bad;
      for (Index j = 0; j < joints; ++j) {
        // Row-major in the file.
        const Eigen::Matrix3d M = numbers.col(t).segment<9>(9 * j).reshaped(3, 3).transpose();
        axis_angle.col(t).segment<3>(3 * j) = AxisAngleOf(M, t, defects);
      }
      if (defects.bad > bad_before) {
        if (defects.first_frame < 0) defects.first_frame = static_cast<int>(t);
        ++defects.frames;
      }
    }
    return axis_angle;
  }
  const std::vector<Index> shape = TrueShape(member);
  const Index width = 3 * joints;
  const bool flat = EndsWith(shape, {width}) && shape.size() <= 2;
  const bool by_joint = joints > 1 && EndsWith(shape, {joints, 3}) && shape.size() <= 3;
  if (!flat && !by_joint) {
    throw Error(
        member.where, fmt::format("has shape {}{}", member.ShapeText(), Guess(shape, joints)),
        joints == 1 ? std::string("Give axis-angle (frames, 3) or matrices (frames, 3, 3)")
                    : fmt::format("Give axis-angle (frames, {}) or matrices (frames, {}, 3, 3)",
                                  width, joints));
  }
  return FiniteColumns(member, width);
}

std::string Describe(const RotationDefects& defects) {
  if (defects.bad == 0) return {};
  std::string text = fmt::format(
      "{} of {} matrices are not rotations (from frame {} on, the worst in frame {}): singular "
      "values {:.3g} to {:.3g}, determinants {:.3g} to {:.3g}",
      defects.bad, defects.matrices, defects.first_frame, defects.worst_frame, defects.min_singular,
      defects.max_singular, defects.min_determinant, defects.max_determinant);
  if (defects.reflections > 0) text += fmt::format(", {} of them reflections", defects.reflections);
  return text;
}

}  // namespace holdfast
