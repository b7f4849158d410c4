// SPDX-License-Identifier: MIT
#include "solver/robot/start_choice.h"

#include <algorithm>
#include <numeric>

#include "solver/grasp/grasp_candidates.h"
#include "solver/grasp/grasp_certificate.h"

namespace holdfast {
namespace {

constexpr double kTouching_m = 0.003;
constexpr double kMostCost = 1.5;             // over the least
constexpr double kFrictions[] = {0.25, 0.4};  // well below that of rubber on most

// Of each link that is near the object, the nearest place.
std::vector<GraspContact> Touches(const RobotSolids& solids, const SignedDistance& object,
                                  const PosedRobot& posed) {
  std::vector<GraspContact> touches;
  for (const int link : solids.Links()) {
    double least = kTouching_m;
    GraspContact touch;
    for (const auto sample : solids.Of(link).samples.colwise()) {
      const SignedDistance::Result hit = object.Query(posed.ObjectFromLink(link) * sample);
      if (hit.distance >= least) continue;
      least = hit.distance;
      touch.point = hit.closest;
      touch.inward = -hit.gradient;
    }
    if (least < kTouching_m) touches.push_back(touch);
  }
  return touches;
}

}  // namespace

int ChooseStart(const RobotHand& hand, const RobotSolids& solids, const SignedDistance& object,
                const TriangleMesh& mesh, const std::vector<RobotPose>& poses,
                const std::vector<double>& costs) {
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return costs[k]; });
  const double most = kMostCost * costs[order.front()];
  const Eigen::Vector3d centre = SolidCentroid(mesh);
  const double radius = (mesh.vertices.colwise() - centre).colwise().norm().maxCoeff();
  std::vector<std::vector<GraspContact>> touches;
  PosedRobot posed(hand);
  for (const std::size_t k : order) {
    if (costs[k] > most) break;
    posed.Set(poses[k]);
    touches.push_back(Touches(solids, object, posed));
  }
  for (const double friction : kFrictions) {
    for (std::size_t i = 0; i < touches.size(); ++i) {
      if (HoldsGravity(touches[i], centre, radius, friction)) return static_cast<int>(order[i]);
    }
  }
  return static_cast<int>(order.front());
}

}  // namespace holdfast
