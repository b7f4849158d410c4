// SPDX-License-Identifier: MIT
#include "solver/take/take_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kYaws = 36;
constexpr int kKept = 24;  // for bodies that stand differently than expected
constexpr double kTooDeep_mm = 6.0;

Matrix3d TurnZ(double angle) { return Eigen::AngleAxisd(angle, Vector3d::UnitZ()).matrix(); }

// World rotation of an upright trunk facing `yaw`: at rest y is up and it faces +z.
Matrix3d TrunkFacing(double yaw) {
  const Matrix3d world_from_rest = (Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();
  return TurnZ(yaw + 0.5 * std::numbers::pi) * world_from_rest;
}

// Expected shoulder of a person arriving along `yaw`: a comfortable reach away, lower for low
// objects (people bend), with the object slightly towards the body's midline.
Vector3d ExpectedShoulder(const ArmIk& arm, const Vector3d& object, double yaw) {
  const Eigen::Matrix3Xd& joints = arm.RestJoints();
  const double standing = joints(1, arm.Bones().root) - joints.row(1).minCoeff() + 0.02;
  const double wrist_z = object.z() + 0.08;
  const double reach = 0.8 * arm.Length();
  const double height = std::min(standing, wrist_z + 0.75 * reach);
  const double above = height - wrist_z;
  const double ahead =
      std::max(0.4 * reach, std::sqrt(std::max(0.0, reach * reach - above * above)));
  const double side = arm.ArmSide() == Side::kRight ? -1.0 : 1.0;
  const Vector3d from_object = TurnZ(yaw) * Vector3d(-ahead - 0.08, 0.12 * side, 0.0);
  return Vector3d(object.x() + from_object.x(), object.y() + from_object.y(), height);
}

// World up direction in the wrist's frame for hands at a table: thumb up, back of the hand up, in
// between, and each with the fingers level, slightly up or down.
std::vector<Vector3d> UpsAtTable(const HandAxes& axes) {
  const Vector3d back = -axes.PalmNormal();
  std::vector<Vector3d> ups;
  for (const Vector3d& up :
       {Vector3d(axes.Across()), Vector3d((axes.Across() + back).normalized()), back}) {
    for (const double tilt : {0.2, 0.0, -0.35, -0.75}) {
      ups.push_back((up + tilt * axes.Forward()).normalized());
    }
  }
  return ups;
}

void Check(const TakeRequest& request) {
  if (request.places.empty()) {
    throw Error("take", "has no position of the object", "Give at least one goal");
  }
  for (const Vector3d& place : request.places) {
    if (!place.allFinite() || place.z() < 0.0) {
      throw Error("take",
                  fmt::format("the position ({}, {}, {}) is not above the ground z = 0", place.x(),
                              place.y(), place.z()),
                  "Give meters, z up");
    }
  }
}

GraspOptions SearchAtTable(const TakeRequest& request, const HandAxes& axes) {
  GraspOptions options;
  options.seed = request.seed;
  options.threads = request.threads;
  options.style = request.style;
  options.up_in_wrist = UpsAtTable(axes);
  options.upright_weight = 1.0;
  options.table_weight = 2.0;
  options.refinements = 64;
  return options;
}

// Accepted grasps, or all if there are none.
std::vector<TakeCandidate> GraspsToScore(const GraspReport& report) {
  std::vector<TakeCandidate> grasps;
  for (const GraspReport::Candidate& candidate : report.candidates) {
    if (!candidate.refused.empty() && report.status == GraspStatus::kFound) continue;
    TakeCandidate take;
    take.grasp = candidate.grasp;
    take.approach.below_mm = candidate.grasp.below_bottom_mm;
    grasps.push_back(take);
  }
  return grasps;
}

// The candidate at its best yaw at the first place, for this shoulder and chest.
TakeCandidate AtBestYaw(const TakeRequest& request, const TakeObject& object, const ArmIk& arm,
                        const Vector3d& shoulder, const Matrix3d& chest,
                        const TakeCandidate& take) {
  const Vector3d& place = request.places.front();
  TakeCandidate best;
  const int yaws = request.object_yaw_rad ? 1 : kYaws;
  for (int k = 0; k < yaws; ++k) {
    TakeCandidate tried = take;
    tried.yaw_rad = request.object_yaw_rad.value_or(2.0 * std::numbers::pi * k / kYaws);
    ScoreTake(arm, shoulder, chest, object.Upright(place, tried.yaw_rad), place.z(), tried);
    if (k == 0 || tried.Beats(best)) best = tried;
  }
  return best;
}

// Wrist targets of the plan's take at each of its places.
std::vector<TakeGoal> GoalsOf(const TakePlan& plan, const TakeObject& object) {
  std::vector<TakeGoal> goals;
  double heading = plan.approach_yaw_rad;
  for (std::size_t k = 0; k < plan.places.size(); ++k) {
    if (k > 0) {
      const Vector3d on = plan.places[k] - plan.places[k - 1];
      if (on.head<2>().norm() > 0.3) heading = std::atan2(on.y(), on.x());
    }
    const double yaw = plan.take.yaw_rad + heading - plan.approach_yaw_rad;
    const Isometry3d wrist = plan.take.WristFor(object.Upright(plan.places[k], yaw));
    TakeGoal goal;
    goal.wrist = wrist.translation();
    goal.hand = wrist.linear();
    goal.approach = k == 0 ? Vector3d(-(TurnZ(yaw) * plan.take.approach.retreat))
                           : Vector3d(TurnZ(heading) * Vector3d::UnitX());
    goal.stay_s = k == 0 ? 0.8 : 0.4;
    goals.push_back(goal);
  }
  return goals;
}

}  // namespace

Vector3d TakeObject::BottomMiddle() const {
  const Vector3d low = mesh.vertices.rowwise().minCoeff(),
                 high = mesh.vertices.rowwise().maxCoeff();
  return {0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), low.z()};
}

Isometry3d TakeObject::Upright(const Vector3d& bottom_middle, double yaw_rad) const {
  return PoseAt(TurnZ(yaw_rad), BottomMiddle(), bottom_middle);
}

void ScoreTake(const ArmIk& arm, const Vector3d& shoulder, const Matrix3d& chest,
               const Isometry3d& world_from_object, double table_z, TakeCandidate& take) {
  const ArmTarget target{shoulder, chest, take.WristFor(world_from_object)};
  take.arm = arm.Best(target);
  take.fault.clear();
  const Vector3d wrist = target.wrist.translation();
  // Penalize stretched arms: beyond 0.9 of their length.
  const double distance = (wrist - shoulder).norm();
  const double stretched = std::max(0.0, distance / arm.Length() - 0.9);
  const double below_mm = std::max(take.grasp.below_bottom_mm, take.approach.below_mm);
  take.score = take.grasp.score - 0.5 * take.arm.discomfort - 10.0 * stretched -
               0.15 * take.approach.through_mm - 0.1 * below_mm;

  // The forearm behind the hand, where it is above the table.
  const Vector3d elbow =
      shoulder + take.arm.limb.upper * (arm.RestJoints().col(arm.Bones().middle) -
                                        arm.RestJoints().col(arm.Bones().root));
  double forearm = 1.0;
  for (int k = 1; k <= 8; ++k) {
    const Vector3d p = wrist + k / 8.0 * (elbow - wrist);
    if ((p - world_from_object.translation()).head<2>().norm() > 0.16) continue;
    forearm = std::min(forearm, p.z() - table_z - 0.035);
  }
  take.score -= 20.0 * std::max(0.0, -forearm);
  if (take.arm.hand_error_rad > 3.0 * kDegree) {
    take.fault = fmt::format("the wrist would bend {:.0f} degrees beyond its limits",
                             take.arm.hand_error_rad / kDegree);
  } else if (distance > arm.Length() + 0.12) {
    take.fault = fmt::format("the grasp is {:.0f} cm beyond the arm's reach",
                             100.0 * (distance - arm.Length()));
  } else if (below_mm > kTooDeep_mm) {
    take.fault = fmt::format("the hand reaches {:.0f} mm into the table", below_mm);
  } else if (forearm < -0.02) {
    take.fault = "the forearm would be in the table";
  } else if (take.approach.through_mm > kTooDeep_mm) {
    take.fault =
        fmt::format("fingers would pass {:.0f} mm through the object", take.approach.through_mm);
  }
}

TakePlan PlanTake(const TakeRequest& request, const HandModel& hand, const TakeObject& object,
                  const GraspProgress& progress) {
  Check(request);
  TakePlan plan;
  plan.side = request.side;
  plan.places = request.places;
  plan.yaw_is_free = !request.object_yaw_rad;
  const Vector3d place = request.places.front();
  const Vector3d way = place - request.pelvis;
  plan.approach_yaw_rad = std::atan2(way.y(), way.x());

  const HandAnatomy anatomy(hand);
  GraspReport report;
  CloseHand(hand, object.mesh, object.surface, object.distance,
            SearchAtTable(request, anatomy.axes), &report, progress);
  plan.status = report.status;
  if (report.candidates.empty() || report.status == GraspStatus::kStopped) return plan;

  std::vector<TakeCandidate> grasps = GraspsToScore(report);
  const ArmIk arm(hand.Surface().RestJoints(), request.side);
  const Matrix3d chest = TrunkFacing(plan.approach_yaw_rad);
  const Vector3d shoulder = ExpectedShoulder(arm, place, plan.approach_yaw_rad);
  const auto score_and_sort = [&] {
    ParallelFor(static_cast<int>(grasps.size()), request.threads, [&](int i) {
      grasps[i] = AtBestYaw(request, object, arm, shoulder, chest, grasps[i]);
    });
    std::ranges::stable_sort(
        grasps, [](const TakeCandidate& a, const TakeCandidate& b) { return a.Beats(b); });
  };
  score_and_sort();
  if (grasps.size() > kKept) grasps.resize(kKept);
  const double bottom = object.BottomMiddle().z();
  ParallelFor(static_cast<int>(grasps.size()), request.threads, [&](int i) {
    grasps[i].approach = FindApproach(anatomy, grasps[i].grasp, object.distance, bottom);
  });
  score_and_sort();
  plan.candidates = std::move(grasps);
  plan.take = plan.candidates.front();

  const Vector3d extent = Extent(object.mesh);
  const double margin = 0.5 * extent.head<2>().norm() + 0.01;
  plan.table = TableAt(place, plan.approach_yaw_rad, std::min(margin, 0.2));
  plan.goals = GoalsOf(plan, object);
  return plan;
}

}  // namespace holdfast
