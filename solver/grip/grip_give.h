// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solver/grip/grip.h"

namespace holdfast {

/// What is gripped, in the frame of the contacts.
struct GrippedSolid {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of mass
  double radius_m = 0.1;                             ///< of its points about it, largest
  double mass_kg = 0.1;
};

struct GripGiveOptions {
  double friction = 0.8;
  double pad_stiffness_N_m = 1e3;  ///< of a contact itself, in each direction
  double gravity_m_s2 = 9.81;
};

/// How far the weight moves the object in the hand (metres; its centre's way and its turn times
/// `radius_m`), along the worst of the six directions of the frame's axes. Joints are springs of
/// `stiffness` (N m a radian, or N a metre, one for each column) that exert the contacts' `press`
/// when nothing pulls; `slopes` is how contacts move with joints (d points / d joints, 3 rows for
/// each contact).
///
/// Contact forces f under a load w are those of least complementary energy,
///     1/2 (f - press)^T (J K^-1 J^T + 1/k) (f - press),
/// that balance w, push and do not pull, and keep to Coulomb's friction: each sideways part is at
/// most `friction` times the push that it has at the solution, so that what slides does not
/// wedge itself tighter. The multiplier of the balance is how the object moves. For small motions.
/// What no forces balance moves by decimetres: the balance is a stiff penalty.
double GripGive(const std::vector<GripContact>& contacts, const Eigen::MatrixXd& slopes,
                const Eigen::VectorXd& stiffness, const GrippedSolid& solid,
                const GripGiveOptions& options = {});

}  // namespace holdfast
