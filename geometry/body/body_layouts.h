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

/// The families of body models, by the joints that their files have.
enum class ModelKind {
  kSmplx,      ///< 55 joints: body, jaw, eyes, hands (Pavlakos et al. 2019)
  kSmplh,      ///< 52: body and hands, no jaw, no eyes (Romero et al. 2017)
  kManoRight,  ///< 16: a right hand alone (Romero et al. 2017)
  kManoLeft,   ///< 16: a left hand alone
};

std::string_view ModelKindName(ModelKind kind);  ///< smplx, smplh, mano_right, mano_left
std::optional<ModelKind> FindModelKind(std::string_view name);

/// The hand that a hand-alone model is; nothing for whole bodies.
std::optional<Side> LoneHand(ModelKind kind);

/// How the joints of a file become SMPL-X's 55, which is what everything else works on.
///
/// SMPL-H is SMPL-X without jaw and eyes. They rest where the head does, carry no vertex and bend
/// no skin: their rotations do nothing.
///
/// MANO is a hand that hangs on nothing. Here it hangs on a body without extent: all joints but the
/// hand's own rest at the wrist's place J_0 and carry nothing. The chain pelvis .. wrist has bones
/// of length zero, so for a pose whose body joints are zero
///
///   G_wrist = [R_root | J_0] [I | 0] ... [I | 0] = [R_root | J_0],  x_world = G x + trans:
///
/// MANO's own v = R (x - J_0) + J_0 + transl with R = root_orient (its global_orient) and trans
/// (its transl), and the fingers follow as in MANO.
struct BodyLayout {
  ModelKind kind;
  std::vector<int> joint_of_native;  ///< SMPL-X's joint of each of the file's
  /// Of each of the 55: the file's joint whose place is its rest place, its own or the stand-in's.
  std::array<int, kNumJoints> native_for_rest;
};

/// The layout of a kind of file.
const BodyLayout& LayoutOf(ModelKind kind);

/// Tells a layout by the parents in a file's kinematic tree (the root's entry is not looked at);
/// for 16 joints kManoRight, the hand's side being no matter of the tree. Throws Error, named
/// `where`, for every other tree.
ModelKind KindByTree(std::span<const std::int64_t> parents, const std::string& where);

/// Which hand 16 rest joints (3 x 16, MANO's order) are of, in any frame and size. The end of the
/// thumb rests on the palm's side of the plane of wrist, index and little finger, so
///   (wrist -> middle1) x (index1 -> pinky1) . (wrist -> thumb3)
/// is positive for a right hand, negative for a left. Nothing when the thumb lies in the plane.
std::optional<Side> SideOfHand(const Eigen::Matrix3Xd& rest_joints);

}  // namespace holdfast
