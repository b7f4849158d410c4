// SPDX-License-Identifier: MIT
#include "geometry/body/body_layouts.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/body/skeleton.h"
#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr int kFingerJoints = 2 * kJointsPerHand;
constexpr int kManoJoints = 1 + kJointsPerHand;
constexpr std::string_view kTreesRead =
    "Give a model with SMPL-X's 55-joint tree, SMPL-H's 52-joint tree or MANO's 16-joint tree";

BodyLayout MakeSmplx() {
  BodyLayout layout{ModelKind::kSmplx, {}, {}};
  for (int j = 0; j < kNumJoints; ++j) {
    layout.joint_of_native.push_back(j);
    layout.native_for_rest[static_cast<std::size_t>(j)] = j;
  }
  return layout;
}

BodyLayout MakeSmplh() {
  BodyLayout layout{ModelKind::kSmplh, {}, {}};
  layout.native_for_rest.fill(kHead);
  const auto add = [&](int joint) {
    layout.native_for_rest[static_cast<std::size_t>(joint)] =
        static_cast<int>(layout.joint_of_native.size());
    layout.joint_of_native.push_back(joint);
  };
  for (int j = 0; j < kNumBodyJoints; ++j) add(j);
  for (int k = 0; k < kFingerJoints; ++k) add(kLeftHandBegin + k);
  return layout;
}

BodyLayout MakeMano(Side side) {
  BodyLayout layout{side == Side::kRight ? ModelKind::kManoRight : ModelKind::kManoLeft, {}, {}};
  layout.native_for_rest.fill(0);
  layout.joint_of_native.push_back(WristJoint(side));
  for (int k = 0; k < kJointsPerHand; ++k) {
    layout.joint_of_native.push_back(HandBegin(side) + k);
    layout.native_for_rest[static_cast<std::size_t>(HandBegin(side) + k)] = 1 + k;
  }
  return layout;
}

// Compares a tree with a layout: each joint must have the parent that it has among the 55. Returns
// the first joint that differs, or -1.
int FirstForeignJoint(const BodyLayout& layout, std::span<const std::int64_t> parents) {
  const std::vector<int>& joints = layout.joint_of_native;
  for (std::size_t k = 1; k < joints.size(); ++k) {
    const std::int64_t parent = parents[k];
    const bool same = parent >= 0 && parent < static_cast<std::int64_t>(k) &&
                      joints[static_cast<std::size_t>(parent)] ==
                          kJointParents[static_cast<std::size_t>(joints[k])];
    if (!same) return static_cast<int>(k);
  }
  return -1;
}

}  // namespace

std::string_view ModelKindName(ModelKind kind) {
  constexpr std::array<std::string_view, 4> kNames = {"smplx", "smplh", "mano_right", "mano_left"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::optional<Side> LoneHand(ModelKind kind) {
  if (kind == ModelKind::kManoRight) return Side::kRight;
  if (kind == ModelKind::kManoLeft) return Side::kLeft;
  return std::nullopt;
}

const BodyLayout& LayoutOf(ModelKind kind) {
  static const std::array<BodyLayout, 4> layouts = {MakeSmplx(), MakeSmplh(),
                                                    MakeMano(Side::kRight), MakeMano(Side::kLeft)};
  return layouts[static_cast<std::size_t>(kind)];
}

ModelKind KindByTree(std::span<const std::int64_t> parents, const std::string& where) {
  const auto joints = static_cast<int>(parents.size());
  ModelKind kind = ModelKind::kSmplx;
  if (joints == kNumJoints - 3) {
    kind = ModelKind::kSmplh;
  } else if (joints == kManoJoints) {
    kind = ModelKind::kManoRight;
  } else if (joints != kNumJoints) {
    throw Error(where,
                fmt::format("has shape (2, {}){}", joints,
                            joints == 24  ? ": SMPL, which has no fingers"
                            : joints == 5 ? ": FLAME, a head"
                                          : ""),
                kTreesRead);
  }
  const BodyLayout& layout = LayoutOf(kind);
  const int foreign = FirstForeignJoint(layout, parents);
  if (foreign >= 0) {
    const auto k = static_cast<std::size_t>(foreign);
    throw Error(
        where,
        fmt::format("gives joint {} ({}) the parent {}", k,
                    kJointNames[static_cast<std::size_t>(layout.joint_of_native[k])], parents[k]),
        kTreesRead);
  }
  return kind;
}

std::optional<Side> SideOfHand(const Eigen::Matrix3Xd& rest_joints) {
  constexpr int kWrist = 0, kIndex1 = 1, kMiddle1 = 4, kPinky1 = 7, kThumb3 = 15;
  const Eigen::Vector3d along = rest_joints.col(kMiddle1) - rest_joints.col(kWrist);
  const Eigen::Vector3d across = rest_joints.col(kPinky1) - rest_joints.col(kIndex1);
  const Eigen::Vector3d normal = along.cross(across);
  const Eigen::Vector3d thumb = rest_joints.col(kThumb3) - rest_joints.col(kWrist);
  const double length = along.norm();
  if (!(normal.norm() > 1e-3 * length * length)) return std::nullopt;
  const double height = thumb.dot(normal.normalized());
  if (!(std::fabs(height) > 0.05 * length)) return std::nullopt;
  return height > 0.0 ? Side::kRight : Side::kLeft;
}

}  // namespace holdfast
