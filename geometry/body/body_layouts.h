// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// Body model families, distinguished by the joints in their files.
enum class ModelKind {
  kSmplx,      ///< 55 joints: body, jaw, eyes, hands (Pavlakos et al. 2019)
  kSmplh,      ///< 52: body and hands, no jaw, no eyes (Romero et al. 2017)
  kManoRight,  ///< 16: right hand only (Romero et al. 2017)
  kManoLeft,   ///< 16: left hand only
};

std::string_view ModelKindName(ModelKind kind);  ///< smplx, smplh, mano_right, mano_left

/// Returns the side of a hand-only model; nothing for whole bodies.
std::optional<Side> LoneHand(ModelKind kind);

/// Maps the joints of a file to SMPL-X's 55, which all other code uses.
///
/// SMPL-H is SMPL-X without jaw and eyes. Their rest positions are at the head, no vertex is
/// skinned to them, and their rotations have no effect.
///
/// MANO is a hand without a body. It is represented on a degenerate body: all joints but the hand's
/// own rest at the wrist position J_0 and have no vertices. The chain pelvis .. wrist has bones of
/// length zero, so for a pose whose body joints are zero
///
///   G_wrist = [R_root | J_0] [I | 0] ... [I | 0] = [R_root | J_0],  x_world = G x + trans:
///
/// This is MANO's own v = R (x - J_0) + J_0 + transl with R = root_orient (its global_orient) and
/// trans (its transl). The fingers follow as in MANO.
struct BodyLayout {
  ModelKind kind;
  std::vector<int> joint_of_native;  ///< SMPL-X joint of each joint of the file
  /// For each of the 55: the file's joint that gives its rest position, its own or a substitute.
  std::array<int, kNumJoints> native_for_rest;
};

/// Returns the layout of a kind of file.
const BodyLayout& LayoutOf(ModelKind kind);

/// Detects the layout from the parents in a file's kinematic tree (the root's entry is ignored).
/// For 16 joints returns kManoRight, since the tree does not determine the side. Throws Error, with
/// `where` as location, for any other tree.
ModelKind KindByTree(std::span<const std::int64_t> parents, const std::string& where);

/// Returns the side of 16 hand rest joints (3 x 16, MANO's order), in any frame and scale. The tip
/// of the thumb rests on the palm side of the plane of wrist, index and little finger, so (wrist ->
/// middle1) x (index1 -> pinky1) . (wrist -> thumb3) is positive for a right hand and negative for
/// a left hand. Returns nothing if the thumb lies in the plane.
std::optional<Side> SideOfHand(const Eigen::Matrix3Xd& rest_joints);

}  // namespace holdfast
