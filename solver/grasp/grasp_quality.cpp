// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_quality.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

using Wrench = Eigen::Matrix<double, 6, 1>;

constexpr int kConeEdges = 8;
constexpr int kStarts = 48;
constexpr int kDescentSteps = 40;
// A pad has an area: it resists some twisting about its normal (metres of lever).
constexpr double kPadLever = 0.006;

// Low-discrepancy directions on the 6-sphere: Kronecker points through the normal quantile's
// logistic approximation; evenness matters, exactness does not.
Wrench WrenchDirection(int i) {
  constexpr double kRatio[6] = {0.9, 0.81, 0.73, 0.656, 0.59, 0.531};
  Wrench w;
  for (int c = 0; c < 6; ++c) {
    const double u = std::fmod(0.5 + (i + 1) * kRatio[c] * std::numbers::phi, 1.0);
    const double safe = std::clamp(u, 0.01, 0.99);
    w(c) = std::log(safe / (1.0 - safe));
  }
  const double norm = w.norm();
  return norm > 1e-9 ? Wrench(w / norm) : Wrench(Wrench::Unit(0));
}

}  // namespace

double WrenchQuality(std::span<const GraspContact> contacts, const Eigen::Vector3d& centroid,
                     double length, double friction) {
  if (contacts.size() < 2 || length <= 0.0) return 0.0;
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrenches(
      6, static_cast<Eigen::Index>(contacts.size()) * (kConeEdges + 2));
  Eigen::Index column = 0;
  for (const GraspContact& contact : contacts) {
    const Eigen::Vector3d n = contact.inward;
    const Eigen::Vector3d t = n.unitOrthogonal();
    const Eigen::Vector3d b = n.cross(t);
    const Eigen::Vector3d arm = (contact.point - centroid) / length;
    for (int e = 0; e < kConeEdges; ++e) {
      const double angle = 2.0 * std::numbers::pi * e / kConeEdges;
      const Eigen::Vector3d force = n + friction * (std::cos(angle) * t + std::sin(angle) * b);
      wrenches.col(column++) << force, arm.cross(force);
    }
    for (const double sign : {-1.0, 1.0}) {
      wrenches.col(column++) << n, arm.cross(n) + sign * friction * kPadLever / length * n;
    }
  }

  double least = std::numeric_limits<double>::infinity();
  for (int start = 0; start < kStarts; ++start) {
    Wrench w = start < 12 ? Wrench((start % 2 ? -1.0 : 1.0) * Wrench::Unit(start / 2))
                          : WrenchDirection(start);
    for (int step = 0; step < kDescentSteps; ++step) {
      Eigen::Index furthest;
      const double support = (w.transpose() * wrenches).maxCoeff(&furthest);
      least = std::min(least, support);
      if (least <= 0.0) return 0.0;
      w -= 0.5 / (1.0 + 0.5 * step) * wrenches.col(furthest);
      const double norm = w.norm();
      if (norm < 1e-9) break;
      w /= norm;
    }
  }
  return least;
}

}  // namespace holdfast
