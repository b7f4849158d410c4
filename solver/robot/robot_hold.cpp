// SPDX-License-Identifier: MIT
#include "solver/robot/robot_hold.h"

#include <algorithm>
#include <cmath>

#include "solver/grasp/grasp_candidates.h"

namespace holdfast {
namespace {

constexpr double kTouching_m = 0.003;
constexpr double kFriction = 0.6;  // lower than rubber on most materials
constexpr double kDensity_kg_m3 = 500.0, kLightest_kg = 0.05, kHeaviest_kg = 0.5;
constexpr double kSqueeze = 8.0, kMinSqueeze_N = 10.0;  // in weights of the object
constexpr double kTurning_Nm = 3.0, kSliding_N_m = 1000.0;

GrippedSolid SolidOf(const TriangleMesh& mesh) {
  GrippedSolid solid;
  solid.center = SolidCentroid(mesh);
  solid.radius_m = (mesh.vertices.colwise() - solid.center).colwise().norm().maxCoeff();
  solid.mass_kg =
      std::clamp(kDensity_kg_m3 * std::abs(SignedVolume(mesh)), kLightest_kg, kHeaviest_kg);
  return solid;
}

// Stiffness of each degree of freedom: the sum over all joints that it moves.
Eigen::VectorXd StiffnessOf(const RobotHand& hand) {
  Eigen::VectorXd stiffness = Eigen::VectorXd::Zero(hand.NumDofs());
  for (const RobotLink& link : hand.links) {
    if (link.dof < 0) continue;
    stiffness(link.dof) += link.factor * link.factor *
                           (link.kind == RobotJointKind::kSliding ? kSliding_N_m : kTurning_Nm);
  }
  return stiffness;
}

}  // namespace

std::vector<GripContact> TouchesOfRobot(const RobotTransferSetup& setup, const PosedRobot& posed,
                                        double touch_m) {
  constexpr double kGridError_m = 0.005;
  const Eigen::Isometry3d root_from_object = posed.Pose().ObjectFromRoot().inverse();
  std::vector<GripContact> contacts;
  for (const int link : setup.solids->Links()) {
    double least = touch_m;
    GripContact contact;
    for (const auto sample : setup.solids->Of(link).samples.colwise()) {
      const Eigen::Vector3d point = posed.ObjectFromLink(link) * sample;
      if (setup.object_grid->Linear(point) > least + kGridError_m) continue;
      const SignedDistance::Result hit = setup.object_distance->Query(point);
      if (hit.distance >= least) continue;
      least = hit.distance;
      contact = {link, root_from_object * hit.closest, -(root_from_object.linear() * hit.gradient),
                 Eigen::Vector3d::Zero()};
    }
    if (least < touch_m) contacts.push_back(contact);
  }
  return contacts;
}

Eigen::MatrixXd ContactSlopes(const RobotState& state, const std::vector<GripContact>& contacts) {
  Eigen::MatrixXd slopes(3 * std::ssize(contacts), state.Hand().NumDofs());
  for (Eigen::Index c = 0; c < std::ssize(contacts); ++c) {
    const GripContact& contact = contacts[static_cast<std::size_t>(c)];
    slopes.middleRows(3 * c, 3) = state.PointJacobian(contact.link, contact.point);
  }
  return slopes;
}

RobotHold::RobotHold(const RobotTransferSetup& setup)
    : setup_(setup), solid_(SolidOf(setup.object)), stiffness_(StiffnessOf(setup.robot)) {}

double RobotHold::Give_m(const PosedRobot& posed) const {
  GripGiveOptions options;
  options.friction = kFriction;
  GrippedSolid solid = solid_;
  solid.center = posed.Pose().ObjectFromRoot().inverse() * solid_.center;
  std::vector<GripContact> contacts = TouchesOfRobot(setup_, posed, kTouching_m);
  BalancePresses(solid.center, solid.radius_m, options.friction,
                 std::max(kMinSqueeze_N, kSqueeze * solid.mass_kg * options.gravity_m_s2),
                 contacts);
  return GripGive(contacts, ContactSlopes(posed.State(), contacts), stiffness_, solid, options);
}

}  // namespace holdfast
