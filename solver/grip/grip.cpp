// SPDX-License-Identifier: MIT
#include "solver/grip/grip.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

constexpr int kEdges = 4;
constexpr double kBalanceWeight = 100.0;

constexpr int kMaxSweeps = 500;
constexpr int kLoadSteps = 10;
constexpr double kSettled_N = 1e-5;   // converged below this change per sweep
constexpr double kMissing_m_N = 0.2;  // displacement of the object per unbalanced force

using Vector6d = Eigen::Matrix<double, 6, 1>;

// Contact forces in the contacts' own axes, push first: the quadratic to minimize, and their
// wrenches on the object.
struct Springs {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd presses;
  Eigen::VectorXd pressed;         // slope at zero force, without load
  SqueezeDual::Wrenches wrenches;  // about the center, torques over the radius
};

Springs SpringsOf(const std::vector<GripContact>& contacts, const Eigen::MatrixXd& slopes,
                  const Eigen::VectorXd& stiffness, const GrippedSolid& solid,
                  double pad_stiffness) {
  const auto count = std::ssize(contacts);
  Springs springs;
  springs.wrenches.resize(6, 3 * count);
  Eigen::VectorXd& presses = springs.presses;
  presses.resize(3 * count);
  Eigen::MatrixXd along(3 * count, slopes.cols());  // slopes in the contacts' axes
  for (Eigen::Index c = 0; c < count; ++c) {
    const GripContact& contact = contacts[static_cast<std::size_t>(c)];
    Eigen::Matrix3d axes;
    axes.col(0) = contact.into;
    axes.col(1) = contact.into.unitOrthogonal();
    axes.col(2) = contact.into.cross(axes.col(1));
    presses.segment<3>(3 * c) = axes.transpose() * contact.press;
    along.middleRows(3 * c, 3) = axes.transpose() * slopes.middleRows(3 * c, 3);
    const Eigen::Vector3d arm = (contact.point - solid.center) / solid.radius_m;
    for (int k = 0; k < 3; ++k) {
      springs.wrenches.col(3 * c + k) << axes.col(k), arm.cross(axes.col(k));
    }
  }
  springs.hessian = along * stiffness.cwiseInverse().asDiagonal() * along.transpose();
  springs.hessian.diagonal().array() += 1.0 / pad_stiffness;
  springs.pressed = -springs.hessian * presses;
  springs.hessian += kMissing_m_N * springs.wrenches.transpose() * springs.wrenches;
  return springs;
}

// One sweep over the contacts (projected Gauss-Seidel). Returns the largest change, N.
double Sweep(const Eigen::MatrixXd& hessian, double friction, Eigen::VectorXd& forces,
             Eigen::VectorXd& slope) {
  double largest = 0.0;
  const auto move = [&](Eigen::Index k, double to) {
    const double step = to - forces(k);
    if (step == 0.0) return;
    forces(k) = to;
    slope += step * hessian.col(k);
    largest = std::max(largest, std::abs(step));
  };
  for (Eigen::Index k = 0; k < forces.size(); k += 3) {
    move(k, std::max(0.0, forces(k) - slope(k) / hessian(k, k)));
    const double stiff = hessian(k + 1, k + 1) + hessian(k + 2, k + 2);
    Eigen::Vector2d aside = forces.segment<2>(k + 1) - slope.segment<2>(k + 1) / stiff;
    const double most = friction * forces(k), length = aside.norm();
    if (length > most) aside *= most / length;
    move(k + 1, aside.x());
    move(k + 2, aside.y());
  }
  return largest;
}

}  // namespace

void BalancePresses(const Eigen::Vector3d& center, double radius_m, double friction, double grip_N,
                    std::vector<GripContact>& contacts) {
  // Edges of the friction cones, grouped by contact: forces with component 1 along `into`, and
  // their wrenches about `center`, force first, torques over `radius_m`.
  Eigen::Matrix3Xd forces(3, kEdges * std::ssize(contacts));
  SqueezeDual::Wrenches wrenches(6, forces.cols());
  Eigen::Index column = 0;
  for (const GripContact& contact : contacts) {
    const Eigen::Vector3d side = contact.into.unitOrthogonal(), up = contact.into.cross(side);
    for (int k = 0; k < kEdges; ++k, ++column) {
      const double angle = 2.0 * std::numbers::pi * k / kEdges;
      const Eigen::Vector3d force =
          contact.into + friction * (std::cos(angle) * side + std::sin(angle) * up);
      forces.col(column) = force;
      wrenches.col(column) << force, (contact.point - center).cross(force) / radius_m;
    }
  }
  Vector6d y = Vector6d::Zero();
  ceres::Problem problem;
  problem.AddResidualBlock(new SqueezeDual(wrenches, kBalanceWeight), nullptr, y.data());
  SolveQuietly(SparseOptions(50, 1e-14), problem);
  const Eigen::VectorXd f = (0.25 - (wrenches.transpose() * y).array()).max(0.0);
  const double pushes = f.sum();
  for (std::size_t c = 0; c < contacts.size() && pushes > 0.0; ++c) {
    const auto begin = static_cast<Eigen::Index>(kEdges * c);
    contacts[c].press =
        grip_N / pushes * forces.middleCols(begin, kEdges) * f.segment(begin, kEdges);
  }
}

double GripGive(const std::vector<GripContact>& contacts, const Eigen::MatrixXd& slopes,
                const Eigen::VectorXd& stiffness, const GrippedSolid& solid,
                const GripGiveOptions& options) {
  const double weight_N = solid.mass_kg * options.gravity_m_s2;
  if (contacts.empty()) return kMissing_m_N * weight_N;
  const Springs springs = SpringsOf(contacts, slopes, stiffness, solid, options.pad_stiffness_N_m);
  // First without load, then with increasing load; else the friction forces would depend on the
  // order of the contacts.
  const auto settle = [&](const Vector6d& load, Eigen::VectorXd& forces) {
    Eigen::VectorXd slope = springs.hessian * forces + springs.pressed +
                            kMissing_m_N * springs.wrenches.transpose() * load;
    for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
      if (Sweep(springs.hessian, options.friction, forces, slope) < kSettled_N) break;
    }
  };
  Eigen::VectorXd squeezed = springs.presses;
  settle(Vector6d::Zero(), squeezed);
  double most = 0.0;
  for (int direction = 0; direction < 6; ++direction) {
    Vector6d load = Vector6d::Zero();
    Eigen::VectorXd forces = squeezed;
    for (int step = 1; step <= kLoadSteps; ++step) {
      load(direction / 2) = (direction % 2 == 0 ? weight_N : -weight_N) * step / kLoadSteps;
      settle(load, forces);
    }
    const Vector6d moved = kMissing_m_N * (springs.wrenches * forces + load);
    most = std::max(most, moved.head<3>().norm() + moved.tail<3>().norm());
  }
  return most;
}

}  // namespace holdfast
