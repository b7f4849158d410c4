// SPDX-License-Identifier: MIT
#include "solver/actions/action_grasps.h"

#include <algorithm>
#include <numbers>

#include "geometry/rotation.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kAlike_m = 0.02, kAlike_rad = 20.0 * std::numbers::pi / 180.0;

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

// The clean ones, best first, no two nearly alike.
std::vector<Grasp> Differing(const GraspReport& report, int most) {
  std::vector<Grasp> kept;
  for (const GraspReport::Candidate& candidate : report.candidates) {
    if (!candidate.refused.empty() || static_cast<int>(kept.size()) == most) continue;
    const auto alike = [&](const Grasp& grasp) { return Alike(grasp, candidate.grasp); };
    if (std::ranges::none_of(kept, alike)) kept.push_back(candidate.grasp);
  }
  return kept;
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
                                    std::uint64_t seed, int most, GraspStatus* status,
                                    int threads) {
  GraspOptions options;
  options.threads = threads;
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
  return Differing(report, most);
}

std::vector<Grasp> FindToolGrips(const HandModel& hand, const ActionObject& object,
                                 std::uint64_t seed, int most, int threads) {
  GraspOptions options;
  options.threads = threads;
  options.seed = seed;
  options.use = GraspUse::kTool;
  options.style = GraspStyle::kPower;
  options.table_weight = 0.0;
  GraspReport report;
  CloseHand(hand, object.mesh, object.surface, object.distance, options, &report);
  std::vector<Grasp> grips = Differing(report, 4 * most);
  std::erase_if(grips, [](const Grasp& grasp) { return !grasp.palm_touching; });
  if (static_cast<int>(grips.size()) > most) grips.resize(static_cast<std::size_t>(most));
  return grips;
}

void AddTurnedOver(const ObjectMarks& marks, std::vector<Grasp>& grasps) {
  if (!marks.two_sided) return;
  const std::size_t count = grasps.size();
  for (std::size_t k = 0; k < count; ++k) {
    Grasp turned = grasps[k];
    turned.wrist_from_object = turned.wrist_from_object * TurnedOver();
    turned.certificate.reset();  // of the other one
    grasps.push_back(std::move(turned));
  }
}

}  // namespace holdfast
