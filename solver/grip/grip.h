// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

/// A grip: contacts of a hand's links with an object go in; a squeeze that balances itself, and how
/// far the object's weight moves it in a hand whose joints are springs, come out.

namespace holdfast {

/// Where a link touches the object, in the hand's frame.
struct GripContact {
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d into = Eigen::Vector3d::Zero();   ///< unit, into the object
  Eigen::Vector3d press = Eigen::Vector3d::Zero();  ///< force that the link should exert there, N
};

/// The squeeze: pushes and friction at the contacts that balance each other on the object as well
/// as can be, each contact taking its share. With g the 4 edges of the friction cone of each
/// contact, f >= 0 of least 100 |sum_g f_g w_g|^2 + sum_g (f_g - 1/4)^2, wrenches w about `center`
/// with torques over `radius_m`; then scaled so that the pushes (along `into`) sum to `grip_N`.
/// After BODex (Chen et al. 2024), which also makes its squeeze by bilevel balance of forces.
void BalancePresses(const Eigen::Vector3d& center, double radius_m, double friction, double grip_N,
                    std::vector<GripContact>& contacts);

/// What is gripped, in the frame of the contacts.
struct GrippedSolid {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of mass
  double radius_m = 0.1;                             ///< of its points about it, largest
  double mass_kg = 0.1;
};

struct GripGiveOptions {
  double friction = 0.8;
  double pad_stiffness_N_m = 1e3;  ///< of a contact itself, in each direction
  double gravity_m_s2 = 9.81;
};

/// How far the weight moves the object in the hand (meters; its center's way and its turn times
/// `radius_m`), along the worst of the six directions of the frame's axes. Joints are springs of
/// `stiffness` (N m a radian, or N a meter, one for each column) that exert the contacts' `press`
/// when nothing pulls; `slopes` is how contacts move with joints (d points / d joints, 3 rows for
/// each contact).
///
/// Contact forces f under a load w are those of least complementary energy,
///     1/2 (f - press)^T (J K^-1 J^T + 1/k) (f - press),
/// that balance w, push and do not pull, and keep to Coulomb's friction: each sideways part is at
/// most `friction` times the push that it has at the solution, so that what slides does not
/// wedge itself tighter. The multiplier of the balance is how the object moves. For small motions.
/// What no forces balance moves by decimeters: the balance is a stiff penalty.
double GripGive(const std::vector<GripContact>& contacts, const Eigen::MatrixXd& slopes,
                const Eigen::VectorXd& stiffness, const GrippedSolid& solid,
                const GripGiveOptions& options = {});

/// Forces f >= 0 of least c |W f|^2 + |f - 1/4|^2 by their dual: y = c W f is the least of
///
///   sum_g max(0, 1/4 - w_g . y)^2 + |y|^2 / c,   and f_g = max(0, 1/4 - w_g . y)
///
/// Residuals: one for each column w_g of W (6 x n), then y / sqrt(c) (6). Parameter block: y (6).
class SqueezeDual final : public ceres::CostFunction {
 public:
  using Wrenches = Eigen::Matrix<double, 6, Eigen::Dynamic>;

  SqueezeDual(Wrenches wrenches, double balance_weight)
      : wrenches_(std::move(wrenches)), scale_(1.0 / std::sqrt(balance_weight)) {
    set_num_residuals(static_cast<int>(wrenches_.cols()) + 6);
    mutable_parameter_block_sizes()->assign(1, 6);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** J) const override {
    const Eigen::Index n = wrenches_.cols();
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> y(parameters[0]);
    Eigen::Map<Eigen::VectorXd> r(residuals, n + 6);
    r << (0.25 - (wrenches_.transpose() * y).array()).max(0.0).matrix(), scale_ * y;
    if (J == nullptr || J[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>> J_y(J[0], n + 6, 6);
    J_y.bottomRows<6>() = scale_ * Eigen::Matrix<double, 6, 6>::Identity();
    for (Eigen::Index g = 0; g < n; ++g) {
      J_y.row(g) = (r(g) > 0.0 ? -1.0 : 0.0) * wrenches_.col(g).transpose();
    }
    return true;
  }

 private:
  Wrenches wrenches_;
  double scale_;
};

}  // namespace holdfast
