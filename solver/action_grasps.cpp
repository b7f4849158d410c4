// SPDX-License-Identifier: MIT
#include "solver/action_grasps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "generator/limb_ik.h"
#include "geometry/rotation.h"
#include "solver/grasp_transfer.h"
#include "solver/hand_axes.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kAlike_m = 0.02, kAlike_rad = 20.0 * std::numbers::pi / 180.0;
constexpr double kHandsApart_m = 0.005, kForearmsApart_m = 0.045, kForearm_m = 0.18;

// World's up in the wrist's frame: thumb up, back of the hand up, and between them; fingers level,
// a little up, or down.
std::vector<Vector3d> UpsInWrist(const HandAxes& axes) {
  const Vector3d back = -axes.PalmNormal();
  std::vector<Vector3d> ups;
  for (const Vector3d& up :
       {Vector3d(axes.Across()), Vector3d((axes.Across() + back).normalized()), back}) {
    for (const double tilt : {0.2, -0.15, -0.6}) {
      ups.push_back((up + tilt * axes.Forward()).normalized());
    }
  }
  return ups;
}

bool Alike(const Grasp& a, const Grasp& b) {
  const Isometry3d from = a.wrist_from_object.inverse(), to = b.wrist_from_object.inverse();
  return (from.translation() - to.translation()).norm() < kAlike_m &&
         AngleBetween(from.linear(), to.linear()) < kAlike_rad;
}

// Distance from points to a forearm behind a wrist, all in the object's frame.
double ForearmDistance(const Eigen::Matrix3Xd& points, const Isometry3d& wrist, Side side) {
  const Vector3d back = -FingerDirection(side, wrist.linear());
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3d from = points.col(i) - wrist.translation();
    const double along = std::clamp(from.dot(back), 0.0, kForearm_m);
    least = std::min(least, (from - along * back).norm());
  }
  return least;
}

}  // namespace

Eigen::Matrix3Xd SkinInWrist(const HandModel& hand, const FingerPose& fingers, int every) {
  HandState state(hand);
  state.SetBody(JointPose::Zero(), Vector3d::Zero());
  state.Evaluate(fingers, false);
  const Eigen::Matrix3d from_world = state.WristRotation().transpose();
  Eigen::Matrix3Xd skin(3, (state.Vertices().cols() + every - 1) / every);
  for (Eigen::Index i = 0; i < skin.cols(); ++i) {
    skin.col(i) = from_world * (state.Vertices().col(i * every) - state.WristPosition());
  }
  return skin;
}

std::vector<Grasp> FindActionGrasps(const HandModel& hand, const ActionObject& object,
                                    std::uint64_t seed, int most, GraspStatus* status) {
  GraspOptions options;
  options.seed = seed;
  options.up_in_wrist = UpsInWrist(HandAxes(hand));
  options.upright_weight = 1.0;
  options.table_weight = 1.5;
  options.handle_weight = 0.5;  // handles are welcome, not a must
  options.closings = 160;
  options.refinements = 36;
  GraspReport report;
  CloseHand(hand, object.mesh, object.surface, object.distance, options, &report);
  if (status != nullptr) *status = report.status;
  std::vector<Grasp> kept;
  for (const GraspReport::Candidate& candidate : report.candidates) {
    if (!candidate.refused.empty() || static_cast<int>(kept.size()) == most) continue;
    const auto alike = [&](const Grasp& grasp) { return Alike(grasp, candidate.grasp); };
    if (std::ranges::none_of(kept, alike)) kept.push_back(candidate.grasp);
  }
  return kept;
}

Grasp MirrorGrasp(const Grasp& grasp) {
  Grasp mirrored = grasp;
  mirrored.fingers = MirrorFingers(grasp.fingers);
  const Vector3d flip(-1.0, 1.0, 1.0);
  mirrored.wrist_from_object.linear() =
      flip.asDiagonal() * grasp.wrist_from_object.linear() * flip.asDiagonal();
  mirrored.wrist_from_object.translation() =
      flip.cwiseProduct(grasp.wrist_from_object.translation());
  return mirrored;
}

std::vector<GraspPair> PairGrasps(const HandModel& right_hand, const std::vector<Grasp>& right,
                                  const HandModel& left_hand, const std::vector<Grasp>& left,
                                  int most) {
  const auto skins = [](const HandModel& hand, const std::vector<Grasp>& grasps) {
    std::vector<Eigen::Matrix3Xd> all;
    for (const Grasp& grasp : grasps) {
      all.push_back(grasp.wrist_from_object.inverse() * SkinInWrist(hand, grasp.fingers, 4));
    }
    return all;
  };
  const std::vector<Eigen::Matrix3Xd> right_skin = skins(right_hand, right);
  const std::vector<Eigen::Matrix3Xd> left_skin = skins(left_hand, left);
  std::vector<GraspPair> pairs;
  for (std::size_t r = 0; r < right.size(); ++r) {
    const Isometry3d right_wrist = right[r].wrist_from_object.inverse();
    for (std::size_t l = 0; l < left.size(); ++l) {
      const Isometry3d left_wrist = left[l].wrist_from_object.inverse();
      if (ForearmDistance(left_skin[l], right_wrist, Side::kRight) < kForearmsApart_m ||
          ForearmDistance(right_skin[r], left_wrist, Side::kLeft) < kForearmsApart_m) {
        continue;
      }
      double least = std::numeric_limits<double>::infinity();
      for (Eigen::Index i = 0; i < right_skin[r].cols(); ++i) {
        least = std::min(
            least,
            (left_skin[l].colwise() - right_skin[r].col(i)).colwise().squaredNorm().minCoeff());
      }
      if (std::sqrt(least) < kHandsApart_m) continue;
      pairs.push_back({static_cast<int>(r), static_cast<int>(l), std::sqrt(least)});
    }
  }
  std::ranges::stable_sort(pairs, std::greater{}, [&](const GraspPair& pair) {
    return right[static_cast<std::size_t>(pair.right)].score +
           left[static_cast<std::size_t>(pair.left)].score;
  });
  if (static_cast<int>(pairs.size()) > most) pairs.resize(static_cast<std::size_t>(most));
  return pairs;
}

}  // namespace holdfast
