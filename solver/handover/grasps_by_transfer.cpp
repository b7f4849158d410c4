// SPDX-License-Identifier: MIT
#include "solver/handover/grasps_by_transfer.h"

#include <array>
#include <utility>

namespace holdfast {

Eigen::Isometry3d WristIn(const HandModel& hand, const JointPose& pose,
                          const Eigen::Vector3d& trans) {
  HandState state(hand);
  state.SetBody(pose, trans);
  return state.WorldFromWrist();
}

GraspMaker GraspsByTransfer(const HandModel& right, const HandModel& left,
                            const TriangleMesh& object, const SignedDistance& surface,
                            const DistanceGrid& distance, const GraspTransferOptions& options,
                            std::vector<Handover>* handovers, ReceivingHands receivers,
                            std::vector<GraspTransfer> made) {
  return [&right, &left, &object, &surface, &distance, options, handovers, receivers,
          made = std::move(made), next = std::size_t{0}](const GraspRequest& request) mutable {
    if (request.frame == 0) return GraspPose{FingersOf(request.pose, request.side), {}};
    const HandModel& receiver = request.side == Side::kRight ? right : left;
    const HandModel& giver = request.side == Side::kRight ? left : right;
    const Eigen::Isometry3d world_from_object = request.object.Transform();
    const auto from_object = [&](const HandModel& hand) {
      return WristIn(hand, request.pose, request.trans).inverse() * world_from_object;
    };
    const auto take_over = [&] {
      std::shared_ptr<const GraspReceiver>& taking =
          receivers[request.side == Side::kRight ? 0 : 1];
      if (!taking) {
        taking =
            std::make_shared<const GraspReceiver>(receiver, object, surface, distance, options);
      }
      return taking->TakeOver(giver, FingersOf(request.pose, giver.HandSide()), from_object(giver),
                              from_object(receiver));
    };
    const GraspTransfer transfer = next < made.size() ? made[next++] : take_over();
    const Eigen::Isometry3d object_from_wrist = transfer.grasp.wrist_from_object.inverse();
    if (handovers != nullptr) {
      handovers->push_back(
          {request.frame, request.side, transfer, from_object(giver) * object_from_wrist});
    }
    const Eigen::Isometry3d wrist = world_from_object * object_from_wrist;
    return GraspPose{transfer.grasp.fingers,
                     OffsetTo(receiver, wrist, request.trans, request.pose)};
  };
}

Eigen::Matrix4Xd HandBalls(const HandAnatomy& anatomy, const FingerPose& fingers) {
  constexpr double kPalmRadius = 0.012;  // meters: half a palm's thickness
  constexpr std::array<double, 4> kAlong = {0.3, 0.55, 0.8, 1.0};
  HandEvaluation evaluation = AtWrist(anatomy.hand);
  Eigen::Matrix3Xd centers;
  BallCenters(anatomy.landmarks, evaluation.At(fingers.data(), false).Vertices(), centers);
  const Eigen::Index in_fingers = centers.cols();
  Eigen::Matrix4Xd balls(4, in_fingers + 4 * kThumb);
  for (Eigen::Index b = 0; b < in_fingers; ++b) {
    balls.col(b) << centers.col(b), anatomy.landmarks.Balls()[b].radius;
  }
  for (int k = 0; k < 4 * kThumb; ++k) {
    balls.col(in_fingers + k) << kAlong[k % 4] * anatomy.axes.RestJoints().col(3 * (k / 4)),
        kPalmRadius;
  }
  return balls;
}

Eigen::Matrix4Xd MovedBalls(const Eigen::Isometry3d& by, Eigen::Matrix4Xd balls) {
  balls.topRows<3>() = (by * balls.topRows<3>()).eval();
  return balls;
}

}  // namespace holdfast
