// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "solver/terms/motion/goal_terms.h"

namespace holdfast {

/// Penalizes both feet leaving the floor: the lowest foot joint must stay low.
///
///   r = sqrt(w) max(0, min_k (q_k,z - rest_k) - allowed),   one residual, meters
///
/// Parameter blocks: positions q_k of the foot joints of one frame (3 each, world, meters);
/// `resting`: their heights with the soles on the floor.
inline MotionTerm Airborne(const std::vector<double>& resting_m, double allowed_m, double weight) {
  const auto evaluate = [resting = resting_m, allowed = allowed_m, scale = std::sqrt(weight)](
                            auto parameters, auto residuals, auto jacobians) {
    std::size_t lowest = 0;
    double height = INFINITY;
    for (std::size_t k = 0; k < resting.size(); ++k) {
      const double above = parameters[k][2] - resting[k];
      if (above < height) {
        height = above;
        lowest = k;
      }
    }
    const double beyond = height - allowed;
    residuals[0] = scale * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    for (std::size_t k = 0; k < resting.size(); ++k) {
      if (jacobians[k] == nullptr) continue;
      std::fill_n(jacobians[k], 3, 0.0);
      if (k == lowest && beyond > 0.0) jacobians[k][2] = scale;
    }
    return true;
  };
  return MakeTerm(1, std::vector<int>(resting_m.size(), 3), evaluate);
}

/// Minimum height of a joint: of a foot, that with the sole on the floor; of the pelvis, since
/// people walk on nearly straight legs.
///
///   r = sqrt(w) max(0, lowest - q_z),   one residual, meters
///
/// Parameter block: the joint's position q (3, world, meters, floor z = 0).
inline MotionTerm FloorContact(double lowest_m, double weight) {
  return MakeTerm<1, 3>([lowest = lowest_m, scale = std::sqrt(weight)](
                            auto parameters, auto residuals, auto jacobians) {
    const double depth = lowest - parameters[0][2];
    residuals[0] = scale * std::max(0.0, depth);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      jacobians[0][0] = jacobians[0][1] = 0.0;
      jacobians[0][2] = depth > 0.0 ? -scale : 0.0;
    }
    return true;
  });
}

/// Share to which a foot at this height is planted: 1 up to 2 cm, 0 from 6 cm, smooth in between.
inline double PlantedShare(double height_m) {
  constexpr double kPlanted = 0.02, kLifted = 0.06;
  const double u = (height_m - kPlanted) / (kLifted - kPlanted);
  if (u <= 0.0) return 1.0;
  return u >= 1.0 ? 0.0 : 1.0 - u * u * (3.0 - 2.0 * u);
}

/// Foot skate: a foot on the floor must not slide.
///
///   r = sqrt(w) S (q' - q),   S = diag(1, 1),   2 residuals, meters per frame
///
/// Parameter blocks: positions of a foot joint in two successive frames (3 each, world, meters).
/// Contact-aware by the weight w c with c = PlantedShare(height of the joint above its height with
/// the sole on the floor), updated as the motion changes and constant in between. A robust loss
/// lets a foot swing past the floor.
inline MotionTerm FootSkate(double weight) {
  return MakeTerm<2, 3, 3>(
      [scale = std::sqrt(weight)](auto parameters, auto residuals, auto jacobians) {
        for (const int k : {0, 1}) residuals[k] = scale * (parameters[1][k] - parameters[0][k]);
        if (jacobians == nullptr) return true;
        for (const int b : {0, 1}) {
          if (jacobians[b] == nullptr) continue;
          const double slope = b == 0 ? -scale : scale;
          Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[b]} << slope, 0.0, 0.0,
              0.0, slope, 0.0;
        }
        return true;
      });
}

}  // namespace holdfast
