// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include "geometry/import/fields.h"
#include "geometry/io/container/data_value.h"

namespace holdfast {

/// A matrix whose singular values are all this near to one is a rotation as single precision has
/// it.
inline constexpr double kRotationTolerance = 1e-3;
/// Farther off than this it was never meant as one.
inline constexpr double kMaxRotationDefect = 0.1;

/// More frames than this are refused: a day at 120 Hz is ten million, no clip has two.
inline constexpr Eigen::Index kMaxImportFrames = 2'000'000;

/// An array with one row of `columns` numbers a frame, whatever its dimensions of one: (T,C),
/// (T,1,C), (1,T,C), (C). Returns (columns x T). Throws Error for other shapes, no frames, and
/// numbers that are not finite (naming the frame).
Eigen::MatrixXd ReadFrameRows(const DataValue& value, Eigen::Index columns);

/// Rotations of `joints` joints a frame, J = `joints`, returned as axis-angle (3J x T), radians:
///   axis-angle (T,3J), (T,J,3);
///   matrices (T,J,3,3), (T,J,9), (T,9J), row-major;
///   6D (Zhou et al. 2019) as (T,J,3,2): the first two columns of the matrix; as (T,J,2,3): its
///   first two rows; as (T,J,6), (T,6J): the two columns in rows of two (SPIN, SMPLify-X), or the
///   two rows one after the other (PyTorch3D), whichever of the two the numbers are orthonormal in.
/// Of one frame the T may be left out. `frames` is how many the motion has, 0 where that is not
/// known: it decides where a shape can be read in two ways. Without it a lone (3,3) of one joint is
/// a matrix when it is a rotation, else three frames of axis-angle.
/// Matrices become the nearest rotation (Frobenius norm, determinant +1), and `defects` grows by
/// what they were. Throws Error for other shapes, also naming what they look like (quaternions, 6D
/// that cannot be told, joint positions), and for numbers that are not finite.
Eigen::MatrixXd ReadRotations(const DataValue& value, int joints, RotationDefects& defects,
                              Eigen::Index frames = 0);

/// The same for the body of an import: `body_defects` grows, `notes` has what is doubtful about 6D.
/// Throws Error besides for a matrix that is far from any rotation, with field, frame and joint.
Eigen::MatrixXd ReadRotations(const DataValue& value, int joints, ImportedClip& imported,
                              Eigen::Index frames = 0);

/// The same for the object of an import, one joint: nearest rotations however far, `object_defects`
/// grows.
Eigen::MatrixXd ReadObjectRotations(const DataValue& value, ImportedClip& imported,
                                    Eigen::Index frames = 0);

/// Notes of `body_defects` and `object_defects`, for the end of an import.
void NoteRotationDefects(ImportedClip& imported);

/// Numbers that ReadRotations would take for one rotation: 3, 6 or 9; nothing for a shape that it
/// refuses.
std::optional<int> NumbersPerRotation(const NpyMember& member, int joints, Eigen::Index frames = 0);

/// "12 of 15 frames are no rotations: singular values 0.34 to 2.07, determinants -1.03 to 4.10, one
/// reflection": for people; empty when all are.
std::string Describe(const RotationDefects& defects);

}  // namespace holdfast
