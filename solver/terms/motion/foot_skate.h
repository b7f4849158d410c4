// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// A foot on the floor stays where it is.
///
///   r = sqrt(w) S (q' - q),   S = diag(1, 1),   2 residuals, metres per frame
///
/// Parameter blocks: positions of a foot's joint in one frame and the next (3 each, world, metres).
/// Contact-aware by the weight: w c with c = PlantedShare(height of the joint above where it is
/// with the sole on the floor), found anew as the motion changes and constant in between. A robust
/// loss lets a foot swing past the floor.
class FootSkate final : public ceres::SizedCostFunction<2, 3, 3> {
 public:
  explicit FootSkate(double weight) : scale_(std::sqrt(weight)) {}

  /// 1 up to 2 cm, 0 from 6 cm on, smooth in between.
  static double PlantedShare(double height_m) {
    constexpr double kPlanted = 0.02, kLifted = 0.06;
    const double u = (height_m - kPlanted) / (kLifted - kPlanted);
    if (u <= 0.0) return 1.0;
    return u >= 1.0 ? 0.0 : 1.0 - u * u * (3.0 - 2.0 * u);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (const int k : {0, 1}) residuals[k] = scale_ * (parameters[1][k] - parameters[0][k]);
    if (jacobians == nullptr) return true;
    for (const int b : {0, 1}) {
      if (jacobians[b] == nullptr) continue;
      const double slope = b == 0 ? -scale_ : scale_;
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[b]} << slope, 0.0, 0.0,
          0.0, slope, 0.0;
    }
    return true;
  }

 private:
  double scale_;
};

}  // namespace holdfast
