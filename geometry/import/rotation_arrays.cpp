// SPDX-License-Identifier: MIT
#include "geometry/import/rotation_arrays.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Index;

// A matrix whose singular values are all this close to one is a rotation in single precision.
constexpr double kRotationTolerance = 1e-3;
// A matrix farther off than this was not meant as a rotation.
constexpr double kMaxRotationDefect = 0.1;

Index SizeOf(const NpyMember& member) { return static_cast<Index>(member.array.NumElements()); }

// Shape without dimensions of size one, but at least one dimension.
std::vector<Index> TrueShape(const NpyMember& member) {
  std::vector<Index> shape;
  for (const std::size_t n : member.array.shape) {
    if (n != 1) shape.push_back(static_cast<Index>(n));
  }
  if (shape.empty()) shape.push_back(1);
  return shape;
}

// Values as (per_frame x frames). Throws Error if one is not finite.
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

// Whether these are the last dimensions.
bool EndsWith(const std::vector<Index>& shape, std::initializer_list<Index> end) {
  return shape.size() >= end.size() &&
         std::equal(end.begin(), end.end(), shape.end() - static_cast<std::ptrdiff_t>(end.size()));
}

bool EndsWithQuaternions(const std::vector<Index>& shape, int joints) {
  return EndsWith(shape, {Index{4} * joints}) || EndsWith(shape, {joints, 4}) ||
         (joints == 1 && EndsWith(shape, {4}));
}

bool IsRotation(const Eigen::Matrix3d& M) {
  return (M.transpose() * M - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3;
}

// How an array stores its rotations.
struct RotationLayout {
  int numbers;  // per rotation: 3 for axis-angle, 6 for 6D, 9 for a matrix
  Index frames;
  // Of 6D: the first two columns in rows of two, or the first two rows; empty: the numbers decide.
  std::optional<bool> interleaved;

  bool operator==(const RotationLayout&) const = default;
};

// All possible readings of the shape, axis-angle first.
std::vector<RotationLayout> LayoutsOf(const NpyMember& member, int joints) {
  const std::vector<Index> shape = TrueShape(member);
  const Index J = joints;
  std::vector<RotationLayout> layouts;
  const auto add = [&](int numbers, std::initializer_list<Index> lengths,
                       std::optional<bool> interleaved = {}) {
    std::vector<Index> frame(lengths);
    std::erase(frame, Index{1});
    const bool one = shape == frame;
    const bool many = shape.size() == frame.size() + 1 &&
                      std::equal(frame.begin(), frame.end(), shape.begin() + 1);
    const RotationLayout layout{numbers, many ? shape[0] : 1, interleaved};
    if ((one || many) && std::ranges::find(layouts, layout) == layouts.end()) {
      layouts.push_back(layout);
    }
  };
  add(3, {3 * J});
  add(3, {J, 3});
  add(9, {J, 3, 3});
  add(9, {J, 9});
  add(9, {9 * J});
  add(6, {J, 3, 2}, true);
  add(6, {J, 2, 3}, false);
  add(6, {J, 6});
  add(6, {6 * J});
  return layouts;
}

std::optional<RotationLayout> LayoutOf(const NpyMember& member, int joints, Index frames) {
  if (SizeOf(member) == 0) return std::nullopt;
  const std::vector<RotationLayout> layouts = LayoutsOf(member, joints);
  if (layouts.size() < 2) return layouts.empty() ? std::nullopt : std::optional(layouts.front());
  // Constant values may be stored once.
  for (const Index count : {frames, Index{1}}) {
    for (const RotationLayout& layout : layouts) {
      if (frames > 0 && layout.frames == count) return layout;
    }
  }
  const std::vector<std::size_t>& whole = member.array.shape;
  const auto matrix = std::ranges::find(layouts, 9, &RotationLayout::numbers);
  if (matrix == layouts.end() || whole.size() < 2 || whole[whole.size() - 2] != 3) {
    return layouts.front();
  }
  if (whole.size() > 2) return *matrix;
  const std::vector<double> values = member.AsDoubles();
  const bool rotation =
      IsRotation(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data()));
  return rotation ? *matrix : layouts.front();
}

constexpr double kSixDTolerance = 0.02;
constexpr double kMinSixDLength = 1e-3;

// The two vectors of 6D numbers, in rows of two (`interleaved`) or one after the other.
std::pair<Eigen::Vector3d, Eigen::Vector3d> SixDVectors(const double* p, bool interleaved) {
  if (interleaved) return {{p[0], p[2], p[4]}, {p[1], p[3], p[5]}};
  return {{p[0], p[1], p[2]}, {p[3], p[4], p[5]}};
}

// Largest deviation of the two vectors from orthonormality, over all rotations.
double SixDDefect(const Eigen::MatrixXd& numbers, bool interleaved) {
  double largest = 0;
  for (Index i = 0; i + 6 <= numbers.size(); i += 6) {
    const auto [a, b] = SixDVectors(numbers.data() + i, interleaved);
    largest =
        std::max({largest, std::abs(a.norm() - 1), std::abs(b.norm() - 1), std::abs(a.dot(b))});
  }
  return largest;
}

// Whether flat 6D numbers are in rows of two: the orthonormal reading decides (down to rounding, as
// rotations near a quarter turn are nearly orthonormal in both), else `known` of the file's other
// fields. Throws Error if neither decides.
bool IsInterleaved(const Eigen::MatrixXd& numbers, const NpyMember& member,
                   std::optional<bool> known) {
  constexpr double kClearly = 0.1, kRounding = 1e-9;
  const double interleaved = SixDDefect(numbers, true), contiguous = SixDDefect(numbers, false);
  const double best = std::min(interleaved, contiguous), other = std::max(interleaved, contiguous);
  if (best < kSixDTolerance && best < kClearly * other && other > kRounding) {
    return interleaved < contiguous;
  }
  if (known) return *known;
  throw Error(
      member.where,
      fmt::format("has shape {}: 6D rotations, but it is ambiguous whether they are stored by rows "
                  "or by columns (they are {})",
                  member.ShapeText(),
                  best < kSixDTolerance ? "orthonormal both ways" : "not orthonormal either way"),
      "Give matrices (frames, joints, 3, 3), or (frames, joints, 3, 2): their first two "
      "columns");
}

// Gram-Schmidt, as in every code that writes 6D.
Eigen::Matrix3d SixDMatrix(const double* p, bool interleaved, const NpyMember& member,
                           Index frame) {
  const auto [a, b] = SixDVectors(p, interleaved);
  const Eigen::Vector3d along = b - a.dot(b) / std::max(a.squaredNorm(), 1e-30) * a;
  if (a.norm() < kMinSixDLength || along.norm() < kMinSixDLength) {
    throw Error(
        member.where,
        fmt::format("holds a 6D rotation in frame {} whose two vectors are parallel or zero",
                    frame),
        "Give rotations: cut such frames out or fill them in");
  }
  Eigen::Matrix3d M;
  M.col(0) = a.normalized();
  M.col(1) = along.normalized();
  M.col(2) = M.col(0).cross(M.col(1));
  return M;
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

constexpr std::string_view kSixDColumnsNote =
    "6D rotations are the first two columns of each matrix, in rows of two";
constexpr std::string_view kSixDRowsNote =
    "warning: 6D rotations are taken as the first two rows of each matrix, one after the other "
    "(PyTorch3D); if they are the first two columns, every rotation is inverted: store matrices "
    "instead";

bool Says(const std::vector<std::string>& texts, std::string_view text) {
  return std::ranges::find(texts, text) != texts.end();
}

// How the 6D rotations of other fields were read; nullopt if there were none.
std::optional<bool> KnownInterleaved(const ImportedClip& imported) {
  if (Says(imported.conventions, kSixDColumnsNote)) return true;
  if (Says(imported.notes, kSixDRowsNote)) return false;
  return std::nullopt;
}

// `defects`: those of the body or the object of `imported`. `strict`: throw Error for a matrix that
// is far from a rotation.
Eigen::MatrixXd ReadAnyRotations(const DataValue& value, int joints, Index frames, bool strict,
                                 RotationDefects& defects, ImportedClip& imported) {
  const NpyMember member = value.Array();
  const std::optional<RotationLayout> layout = LayoutOf(member, joints, frames);
  if (!layout) {
    throw Error(member.where,
                fmt::format("has shape {}{}", member.ShapeText(),
                            EndsWithQuaternions(TrueShape(member), joints)
                                ? ": quaternions, whose order the file does not state"
                                : ""),
                joints == 1
                    ? std::string("Give axis-angle (frames, 3) or matrices (frames, 3, 3)")
                    : fmt::format("Give axis-angle (frames, {}) or matrices (frames, {}, 3, 3)",
                                  3 * joints, joints));
  }
  const int numbers = layout->numbers;
  Eigen::MatrixXd stored = FiniteColumns(member, Index{numbers} * joints);
  if (numbers == 3) return stored;
  Eigen::MatrixXd axis_angle(3 * joints, stored.cols());
  bool interleaved = layout->interleaved.value_or(false);
  if (numbers == 6 && !layout->interleaved) {
    interleaved = IsInterleaved(stored, member, KnownInterleaved(imported));
  }
  for (Index t = 0; t < stored.cols(); ++t) {
    const int bad_before = defects.bad;
    for (Index j = 0; j < joints; ++j) {
      const double* const p = stored.col(t).data() + numbers * j;
      Eigen::Matrix3d M;
      if (numbers == 9) {
        M = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(p);
      } else {
        M = SixDMatrix(p, interleaved, member, t);
        // The first two rows are the first two columns of the transpose.
        if (!interleaved) M.transposeInPlace();
      }
      const RotationDefects before = defects;
      axis_angle.col(t).segment<3>(3 * j) = AxisAngleOf(M, t, defects);
      const bool reflected = defects.reflections > before.reflections;
      const double off = (M.transpose() * M - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
      if (!strict || (!reflected && off <= 2 * kMaxRotationDefect)) continue;
      throw Error(member.where,
                  fmt::format("holds a matrix that is {} in frame {}{}",
                              reflected ? "a reflection, not a rotation,"
                                        : fmt::format("not a rotation (R'R is off by {:.3g})", off),
                              t, joints > 1 ? fmt::format(", joint {}", j) : ""),
                  "Give rotation matrices, row-major, or axis-angle");
    }
    if (defects.bad > bad_before) {
      if (defects.first_frame < 0) defects.first_frame = static_cast<int>(t);
      ++defects.frames;
    }
  }
  if (numbers == 6) {
    std::vector<std::string>& texts = interleaved ? imported.conventions : imported.notes;
    const std::string_view note = interleaved ? kSixDColumnsNote : kSixDRowsNote;
    if (!Says(texts, note)) texts.emplace_back(note);
  }
  return axis_angle;
}

}  // namespace

Eigen::MatrixXd ReadFrameRows(const DataValue& value, Index columns) {
  const NpyMember member = value.Array();
  const std::vector<Index> shape = TrueShape(member);
  const bool one_row = shape.size() == 1 && shape[0] == columns;
  const bool rows = shape.size() == 2 && shape[1] == columns;
  // One number per frame may have shape (T).
  const bool numbers = columns == 1 && shape.size() == 1;
  if (!one_row && !rows && !numbers) {
    throw Error(member.where, fmt::format("has shape {}", member.ShapeText()),
                fmt::format("Give (frames, {})", columns));
  }
  return FiniteColumns(member, columns);
}

std::optional<int> NumbersPerRotation(const NpyMember& member, int joints, Index frames) {
  const std::optional<RotationLayout> layout = LayoutOf(member, joints, frames);
  return layout ? std::optional(layout->numbers) : std::nullopt;
}

Eigen::MatrixXd ReadRotations(const DataValue& value, int joints, ImportedClip& imported,
                              Index frames) {
  return ReadAnyRotations(value, joints, frames, true, imported.body_defects, imported);
}

Eigen::MatrixXd ReadObjectRotations(const DataValue& value, ImportedClip& imported, Index frames) {
  return ReadAnyRotations(value, 1, frames, false, imported.object_defects, imported);
}

void NoteRotationDefects(ImportedClip& imported) {
  for (const auto& [whose, defects] :
       {std::pair{"body", imported.body_defects}, {"object", imported.object_defects}}) {
    if (defects.bad == 0) continue;
    imported.notes.push_back(fmt::format(
        "warning: the {}: {} of {} matrices are not rotations (from frame {} on, the worst in "
        "frame {}): singular values {:.3g} to {:.3g}, determinants {:.3g} to {:.3g}{}; replaced "
        "by the nearest rotations (SVD, determinant +1)",
        whose, defects.bad, defects.matrices, defects.first_frame, defects.worst_frame,
        defects.min_singular, defects.max_singular, defects.min_determinant,
        defects.max_determinant,
        defects.reflections > 0 ? fmt::format(", {} of them reflections", defects.reflections)
                                : ""));
  }
}

}  // namespace holdfast
