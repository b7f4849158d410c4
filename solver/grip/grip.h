// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

/// Grip under load. Input: contacts of a hand's links with an object. Output: a self-balancing
/// squeeze, and the object's displacement by its weight in a hand with joints as springs.

namespace holdfast {

/// Contact of a link with the object, in the hand frame.
struct GripContact {
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d into = Eigen::Vector3d::Zero();   ///< unit, into the object
  Eigen::Vector3d press = Eigen::Vector3d::Zero();  ///< target force of the link there, N
  double gap_m = 0.0;  ///< distance of the link from the object, along `into`
};

/// Computes the squeeze: pushes and friction at the contacts that balance each other on the object
/// as well as possible, with all contacts involved. With g the 4 edges of each contact's friction
/// cone, f >= 0 minimizes 100 |sum_g f_g w_g|^2 + sum_g (f_g - 1/4)^2, with wrenches w about
/// `center` and torques over `radius_m`; then f is scaled so that the pushes (along `into`) sum to
/// `grip_N`. After BODex (Chen et al. 2024), whose squeeze also comes from a bilevel force balance.
void BalancePresses(const Eigen::Vector3d& center, double radius_m, double friction, double grip_N,
                    std::vector<GripContact>& contacts);

/// The gripped object, in the frame of the contacts.
struct GrippedSolid {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of mass
  double radius_m = 0.1;                             ///< maximum of its points
  double mass_kg = 0.1;
};

struct GripGiveOptions {
  double friction = 0.8;
  double pad_stiffness_N_m = 1e3;  ///< of a contact itself, in each direction
  double gravity_m_s2 = 9.81;
};

/// Displacement of the object in the hand by its weight (meters; shift of its center plus its
/// rotation times `radius_m`), in the worst of the six directions of the frame's axes. Joints are
/// springs of `stiffness` (N m per radian, or N per meter, one per column) that exert the contacts'
/// `press` without a load; `slopes` is the contact Jacobian (d points / d joints, 3 rows per
/// contact).
///
/// Contact forces f under a load w minimize the complementary energy
///     1/2 (f - press)^T (J K^-1 J^T + 1/k) (f - press)
/// subject to balancing w, pushing without pulling, and Coulomb friction: each tangential component
/// is at most `friction` times the push at the solution, so that a sliding contact does not wedge
/// itself tighter. The multiplier of the balance is the object's displacement. For small motions.
/// If no forces balance the load, the result is decimeters: the balance is a stiff penalty.
double GripGive(const std::vector<GripContact>& contacts, const Eigen::MatrixXd& slopes,
                const Eigen::VectorXd& stiffness, const GrippedSolid& solid,
                const GripGiveOptions& options = {});

/// Forces f >= 0 that minimize c |W f|^2 + |f - 1/4|^2, by their dual: y = c W f minimizes
///
///   sum_g max(0, 1/4 - w_g . y)^2 + |y|^2 / c,   and f_g = max(0, 1/4 - w_g . y)
///
/// Residuals: one per column w_g of W (6 x n), then y / sqrt(c) (6). Parameter block: y (6).
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
