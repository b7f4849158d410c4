// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <Eigen/Core>

#include "geometry/import/imported_clip.h"
#include "geometry/io/container/data_value.h"

namespace holdfast {

/// A matrix whose singular values are all this near to one is a rotation as single precision has
/// it.
inline constexpr double kRotationTolerance = 1e-3;

/// More frames than this are refused: a day at 120 Hz is ten million, no clip has two.
inline constexpr Eigen::Index kMaxImportFrames = 2'000'000;

/// An array with one row of `columns` numbers a frame, whatever its dimensions of one: (T,C),
/// (T,1,C), (1,T,C), (C). Returns (columns x T). Throws Error for other shapes, no frames, and
/// numbers that are not finite (naming the frame).
Eigen::MatrixXd ReadFrameRows(const DataValue& value, Eigen::Index columns);

/// Rotations of `joints` joints a frame: axis-angle (T,3J), (T,J,3) or, of one frame, (3J), (J,3);
/// or matrices (T,J,3,3), (T,J,9), (T,9J), (J,3,3). A lone (3,3) of one joint is a matrix when it
/// is one, else three frames. Matrices become the nearest rotation (Frobenius norm, determinant
/// +1), and `defects` grows by what they were. Returns axis-angle (3J x T), radians. Throws Error
/// for other shapes, also naming what they look like (quaternions, 6D, joint positions), and for
/// numbers that are not finite.
Eigen::MatrixXd ReadRotations(const DataValue& value, int joints, RotationDefects& defects);

/// Whether the array holds matrices (as ReadRotations would read it).
bool HoldsMatrices(const NpyMember& member, int joints);

/// "12 of 15 frames are no rotations: singular values 0.34 to 2.07, determinants -1.03 to 4.10, one
/// reflection": for people; empty when all are.
std::string Describe(const RotationDefects& defects);

}  // namespace holdfast
