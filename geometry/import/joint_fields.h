// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"
#include "geometry/import/fields.h"
#include "geometry/io/container/data_value.h"

namespace holdfast {

/// Returns T poses at rest for a motion whose largest array is `main`. Throws Error if `main` has
/// fewer than `numbers` values per frame: a pose takes 1,320 bytes, and a short array must not
/// allocate millions of them.
std::vector<JointPose> RestPoses(Eigen::Index frames, const DataValue& main, Eigen::Index numbers);

/// Copies rotations (3k x T) to joints [begin, begin + k) of T poses. A single frame is copied to
/// all poses: constant values are often stored once. Throws Error naming `where` for other lengths.
void SetJoints(std::vector<JointPose>& pose, int begin, const Eigen::MatrixXd& rotations,
               std::string_view where);

/// Reads `global_orient`, `body_pose` and, if `needs_face` or if the file has them, `jaw_pose`,
/// `leye_pose` and `reye_pose` into the clip's poses.
void ReadBodyJoints(const Fields& params, bool needs_face, ImportedClip& imported);

/// Throws Error unless `found` equals `frames`.
void RequireFrames(std::string_view where, std::string_view name, Eigen::Index found,
                   Eigen::Index frames);

/// Reads the track of a thing that acts on row vectors, v_world = v R + t, from `transl` and
/// `global_orient`: its rotations are transposed by negating the axis-angle. Throws Error unless it
/// has `frames` frames.
ObjectTrack ReadRowTrack(const Fields& params, Eigen::Index frames, ImportedClip& imported);

/// Reads shape coefficients (B x rows): one set (B), (1,B), (B,1), or one per frame (T,B). No
/// columns for an empty array.
Eigen::MatrixXd ReadBetas(const DataValue& value);

/// Sets the clip's shape, one per person, to the mean of `betas`; adds a note if they differ.
void SetBetas(const Eigen::MatrixXd& betas, ImportedClip& imported);

/// Appends `more` to `texts`.
void Append(std::vector<std::string>& texts, std::vector<std::string> more);

/// Imports parameters from one array without names, identified by the numbers per frame:
///   322: Motion-X (Lin et al., 2023): root 3, body 63, hands 90, jaw 3, expression 50, face shape
///        100, trans 3, betas 10; y-up, 30 Hz
///   165: the 55 joints of SMPL-X, axis-angle or any form of ReadRotations; no translation
///   156: the 52 joints of SMPL-H, likewise
/// Features of HumanML3D (263), KIT-ML (251) and HumanTOMATO (623), and joint positions, hold no
/// rotations of this skeleton and are rejected by name; so is ARCTIC's object (7) without its body.
/// Throws Error for every other shape.
ImportedClip ImportParameterArray(const DataValue& value, const ParameterOptions& options);

}  // namespace holdfast
