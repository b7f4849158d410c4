// SPDX-License-Identifier: MIT
#include "solver/grip/grip.h"

#include <cmath>
#include <numbers>

#include "solver/grip/squeeze_dual.h"
#include "solver/unknowns/sparse_solve.h"

namespace holdfast {
namespace {

constexpr int kEdges = 4;
constexpr double kBalanceWeight = 100.0;

// Edges of the friction cones, those of a contact side by side: forces whose part along `into` is
// 1, and their wrenches about `centre`, force first, torques over `radius_m`.
struct ConeEdges {
  ConeEdges(const std::vector<GripContact>& contacts, const Eigen::Vector3d& centre,
            double radius_m, double friction);
  Eigen::Matrix3Xd forces;
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrenches;
};

ConeEdges::ConeEdges(const std::vector<GripContact>& contacts, const Eigen::Vector3d& centre,
                     double radius_m, double friction)
    : forces(3, kEdges * std::ssize(contacts)), wrenches(6, forces.cols()) {
  Eigen::Index column = 0;
  for (const GripContact& contact : contacts) {
    const Eigen::Vector3d side = contact.into.unitOrthogonal(), up = contact.into.cross(side);
    for (int k = 0; k < kEdges; ++k, ++column) {
      const double angle = 2.0 * std::numbers::pi * k / kEdges;
      const Eigen::Vector3d force =
          contact.into + friction * (std::cos(angle) * side + std::sin(angle) * up);
      forces.col(column) = force;
      wrenches.col(column) << force, (contact.point - centre).cross(force) / radius_m;
    }
  }
}

}  // namespace

void BalancePresses(const Eigen::Vector3d& centre, double radius_m, double friction, double grip_N,
                    std::vector<GripContact>& contacts) {
  const ConeEdges edges(contacts, centre, radius_m, friction);
  Eigen::Matrix<double, 6, 1> y = Eigen::Matrix<double, 6, 1>::Zero();
  ceres::Problem problem;
  problem.AddResidualBlock(new SqueezeDual(edges.wrenches, kBalanceWeight), nullptr, y.data());
  SolveQuietly(SparseOptions(50, 1e-14), problem);
  const Eigen::VectorXd f = (0.25 - (edges.wrenches.transpose() * y).array()).max(0.0);
  const double pushes = f.sum();
  for (std::size_t c = 0; c < contacts.size() && pushes > 0.0; ++c) {
    const auto begin = static_cast<Eigen::Index>(kEdges * c);
    contacts[c].press =
        grip_N / pushes * edges.forces.middleCols(begin, kEdges) * f.segment(begin, kEdges);
  }
}

}  // namespace holdfast
