// SPDX-License-Identifier: MIT
#include "solver/evaluation/pass_study.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"

namespace holdfast {
namespace {

constexpr std::uint8_t kBothHold = kHoldsRight | kHoldsLeft;

// A wrist over time, 3 x T.
Eigen::Matrix3Xd WristPath(const Clip& clip, const Eigen::Matrix3Xd& rest_joints, Side side) {
  Eigen::Matrix3Xd path(3, clip.NumFrames());
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    path.col(t) = state.joints.col(WristJoint(side));
  }
  return path;
}

// Of the hand that has the object (`carrying`) or of the other, over the clip's.
double AccelerationRatio(const std::array<Eigen::Matrix3Xd, 2>& was,
                         const std::array<Eigen::Matrix3Xd, 2>& is,
                         const std::vector<std::uint8_t>& holding, bool carrying) {
  double before = 0.0, after = 0.0;
  for (int h = 0; h < 2; ++h) {
    for (Eigen::Index t = 1; t + 1 < was[h].cols(); ++t) {
      if (holding[t] == kBothHold || ((holding[t] >> h & 1) != 0) != carrying) continue;
      const auto bend = [t](const Eigen::Matrix3Xd& path) {
        return (path.col(t - 1) - 2.0 * path.col(t) + path.col(t + 1)).norm();
      };
      before += bend(was[h]);
      after += bend(is[h]);
    }
  }
  return before > 0.0 ? after / before : 1.0;
}

}  // namespace

std::optional<PassRow> TryPass(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                               CarryOptions options, const StagedProgress& progress) {
  options.hand_over = true;
  const CarryReport carried = CarryObject(clip, body, object, options, progress);
  if (carried.status == CarryStatus::kStopped) return std::nullopt;
  PassRow row;
  row.object = object.object.name;
  if (carried.status != CarryStatus::kCarried) {
    row.fault = carried.status == CarryStatus::kNoGrasp ? carried.grasp.status : "no hand touches";
    return row;
  }
  const auto widen = [](const WristChange& change, WristChange& most) {
    most.moved_m = std::max(most.moved_m, change.moved_m);
    most.turned_rad = std::max(most.turned_rad, change.turned_rad);
  };
  for (const Handover& handover : carried.handovers) {
    ++row.handovers;
    row.clean += handover.transfer.found ? 1 : 0;
    widen(handover.receiver, row.receiver);
    widen(handover.giver, row.giver);
  }
  row.deepest_mm = carried.contact.penetration_max_mm;
  const Eigen::Matrix3Xd rest_joints = BodySurface(body.model, body.betas).RestJoints();
  std::array<Eigen::Matrix3Xd, 2> was, is;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const int h = side == Side::kRight ? 0 : 1;
    was[h] = WristPath(clip, rest_joints, side);
    is[h] = WristPath(carried.clip, rest_joints, side);
  }
  row.carrying_acceleration = AccelerationRatio(was, is, carried.clip.holding_hand, true);
  row.free_acceleration = AccelerationRatio(was, is, carried.clip.holding_hand, false);
  return row;
}

Clip MirroredClip(const Clip& clip, const ClipBody& body) {
  Clip mirrored = clip;
  mirrored.object.reset();
  const double pelvis = BodySurface(body.model, body.betas).RestJoints()(0, kPelvis);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    mirrored.pose[t] = MirrorPose(clip.pose[t]);
    mirrored.trans(0, t) = -clip.trans(0, t) - 2.0 * pelvis;
  }
  for (std::uint8_t& bits : mirrored.holding_hand) {
    if (bits == kHoldsRight || bits == kHoldsLeft) bits ^= kBothHold;
  }
  return mirrored;
}

PassRow SummarizePasses(std::span<const PassRow> rows) {
  PassRow all;
  all.carrying_acceleration = all.free_acceleration = 0.0;
  int count = 0;
  for (const PassRow& row : rows) count += row.fault.empty() ? 1 : 0;
  for (const PassRow& row : rows) {
    if (!row.fault.empty()) continue;
    all.handovers += row.handovers;
    all.clean += row.clean;
    all.receiver.moved_m += row.receiver.moved_m / count;
    all.receiver.turned_rad += row.receiver.turned_rad / count;
    all.giver.moved_m += row.giver.moved_m / count;
    all.giver.turned_rad += row.giver.turned_rad / count;
    all.deepest_mm = std::max(all.deepest_mm, row.deepest_mm);
    all.carrying_acceleration = std::max(all.carrying_acceleration, row.carrying_acceleration);
    all.free_acceleration = std::max(all.free_acceleration, row.free_acceleration);
  }
  return all;
}

}  // namespace holdfast
