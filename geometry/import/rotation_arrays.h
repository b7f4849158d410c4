// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <Eigen/Core>

#include "geometry/import/fields.h"
#include "geometry/io/container/data_value.h"

namespace holdfast {

/// More frames are rejected: no clip has two million (a day at 120 Hz is ten million).
inline constexpr Eigen::Index kMaxImportFrames = 2'000'000;

/// Reads an array with one row of `columns` numbers per frame, ignoring dimensions of size one:
/// (T,C), (T,1,C), (1,T,C), (C). Returns (columns x T). Throws Error for other shapes, no frames,
/// and numbers that are not finite (naming the frame).
Eigen::MatrixXd ReadFrameRows(const DataValue& value, Eigen::Index columns);

/// Reads rotations of J = `joints` joints per frame; returns axis-angle (3J x T), radians. Forms:
///   axis-angle (T,3J), (T,J,3);
///   matrices (T,J,3,3), (T,J,9), (T,9J), row-major;
///   6D (Zhou et al. 2019) as (T,J,3,2): the first two columns of the matrix; as (T,J,2,3): its
///     first two rows; as (T,J,6), (T,6J): the two columns in rows of two (SPIN, SMPLify-X), or the
///     two rows one after the other (PyTorch3D), whichever reading is orthonormal.
/// A single frame may lack T. `frames` is the number of frames of the motion, 0 if unknown; it
/// decides between two readings of a shape. Without it, a single (3,3) of one joint is a matrix if
/// it is a rotation, else three frames of axis-angle.
/// Matrices become the nearest rotation (Frobenius norm, determinant +1); `body_defects`
/// accumulates their deviations, and doubts about 6D are added to `notes`. Throws Error for other
/// shapes, naming what they look like (quaternions, ambiguous 6D, joint positions), for numbers
/// that are not finite, and for a matrix far from any rotation, naming field, frame and joint.
Eigen::MatrixXd ReadRotations(const DataValue& value, int joints, ImportedClip& imported,
                              Eigen::Index frames = 0);

/// Same for the object of an import, one joint: accepts any matrix by its nearest rotation and
/// extends `object_defects`.
Eigen::MatrixXd ReadObjectRotations(const DataValue& value, ImportedClip& imported,
                                    Eigen::Index frames = 0);

/// Adds notes about `body_defects` and `object_defects` at the end of an import.
void NoteRotationDefects(ImportedClip& imported);

/// Numbers that ReadRotations would read per rotation: 3, 6 or 9; nullopt for a shape that it
/// rejects.
std::optional<int> NumbersPerRotation(const NpyMember& member, int joints, Eigen::Index frames = 0);

}  // namespace holdfast
