// SPDX-License-Identifier: MIT
#include "solver/actions/action_pairs.h"

#include <algorithm>
#include <limits>

#include "generator/actions/script_poses.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/handover/grasp_transfer.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kComfortable = 25.0;  // of both arms' discomfort together
constexpr int kTurns = 36;

Matrix3d FacingFront() { return (Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished(); }

// A person who stands upright, facing -y, and holds something before the chest.
class Meeting {
 public:
  Meeting(const Eigen::Matrix3Xd& rest_joints, const TriangleMesh& mesh)
      : rest_joints_(rest_joints),
        right_(rest_joints, Side::kRight),
        left_(rest_joints, Side::kLeft) {
    const Vector3d middle =
        0.5 * (mesh.vertices.rowwise().minCoeff() + mesh.vertices.rowwise().maxCoeff());
    const Vector3d place =
        Shoulder(right_) + Vector3d(-Shoulder(right_).x(), -0.6 * right_.Length(), -0.2);
    poses_ = UprightPoses(middle, place, kTurns, {0.4});
  }

  const std::vector<Isometry3d>& Poses() const { return poses_; }
  double Cost(Side side, const Isometry3d& object, const Grasp& grasp) const {
    const ArmIk& arm = side == Side::kRight ? right_ : left_;
    const ArmChoice choice =
        arm.Best({Shoulder(arm), FacingFront(), object * grasp.wrist_from_object.inverse()});
    return choice.discomfort + 50.0 * choice.shortfall_m;
  }

 private:
  Vector3d Shoulder(const ArmIk& arm) const {
    return FacingFront() * (rest_joints_.col(arm.Bones().root) - rest_joints_.col(0));
  }

  const Eigen::Matrix3Xd& rest_joints_;
  ArmIk right_, left_;
  std::vector<Isometry3d> poses_;
};

// The other side's wrist, where a mirror in the middle of the body has it.
Isometry3d Mirrored(const Isometry3d& wrist) {
  const Vector3d flip(-1.0, 1.0, 1.0);
  return RigidTransform(flip.asDiagonal() * wrist.linear() * flip.asDiagonal(),
                        flip.cwiseProduct(wrist.translation()));
}

}  // namespace

std::vector<GraspPair> FindGraspPairs(const HandModel& right_hand, const HandModel& left_hand,
                                      const ActionObject& object, const std::vector<Grasp>& right,
                                      std::uint64_t seed, int tries) {
  const Meeting meeting(right_hand.Surface().RestJoints(), object.mesh);
  struct Offered {
    double cost;
    std::size_t grasp;
    Isometry3d object;
  };
  std::vector<Offered> offered;
  for (std::size_t g = 0; g < right.size(); ++g) {
    Offered best{std::numeric_limits<double>::infinity(), g, Isometry3d::Identity()};
    for (const Isometry3d& pose : meeting.Poses()) {
      const double cost = meeting.Cost(Side::kRight, pose, right[g]);
      if (cost < best.cost) best = {cost, g, pose};
    }
    offered.push_back(best);
  }
  std::ranges::stable_sort(offered, {}, &Offered::cost);
  if (static_cast<int>(offered.size()) > tries) offered.resize(static_cast<std::size_t>(tries));

  std::vector<GraspPair> pairs;
  GraspTransferOptions options;
  options.seed = seed;
  options.closings = 12;
  for (const Offered& offer : offered) {
    const Grasp& giving = right[offer.grasp];
    const Isometry3d wrist = offer.object * giving.wrist_from_object.inverse();
    const GraspTransfer transfer =
        TransferGrasp(right_hand, giving.fingers, giving.wrist_from_object, left_hand,
                      Mirrored(wrist).inverse() * offer.object, object.mesh, object.surface,
                      object.distance, options);
    if (!transfer.found) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const Isometry3d& pose : meeting.Poses()) {
      least = std::min(least, meeting.Cost(Side::kRight, pose, giving) +
                                  meeting.Cost(Side::kLeft, pose, transfer.grasp));
    }
    if (least < kComfortable) pairs.push_back({giving, transfer.grasp});
  }
  return pairs;
}

}  // namespace holdfast
