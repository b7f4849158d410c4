// SPDX-License-Identifier: MIT
#include "solver/fit/time_filters.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace holdfast {

Eigen::MatrixXd GaussianFilter(const Eigen::MatrixXd& values, double sigma_frames) {
  const auto reach = static_cast<Eigen::Index>(std::ceil(3.0 * sigma_frames));
  Eigen::MatrixXd smooth(values.rows(), values.cols());
  for (Eigen::Index t = 0; t < values.cols(); ++t) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(values.rows());
    double weights = 0.0;
    for (Eigen::Index u = std::max<Eigen::Index>(0, t - reach);
         u <= std::min(values.cols() - 1, t + reach); ++u) {
      const double k = static_cast<double>(u - t) / sigma_frames;
      const double weight = std::exp(-0.5 * k * k);
      sum += weight * values.col(u);
      weights += weight;
    }
    smooth.col(t) = sum / weights;
  }
  return smooth;
}

double NoiseAfterSmoothing(double sigma_frames) {
  // The sum of a normalised Gaussian's squared weights is 1 / (2 sqrt(pi) sigma).
  return std::min(1.0, 1.0 / std::sqrt(2.0 * std::sqrt(std::numbers::pi) * sigma_frames));
}

double NoiseOfSlope(Eigen::Index reach) {
  const double n = static_cast<double>(reach);
  return 1.0 / std::sqrt(n * (n + 1.0) * (2.0 * n + 1.0) / 3.0);
}

double WhiteNoise(const Eigen::Matrix3Xd& positions) {
  if (positions.cols() < 5) return 0.0;
  std::vector<double> bends;
  for (Eigen::Index t = 1; t + 1 < positions.cols(); ++t) {
    bends.push_back((positions.col(t - 1) - 2.0 * positions.col(t) + positions.col(t + 1)).norm());
  }
  const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
  std::nth_element(bends.begin(), middle, bends.end());
  // White noise has second differences of root 6 times its size; 1.538 is the median length of a
  // normal vector in three dimensions.
  return *middle / (1.538 * std::sqrt(6.0));
}

}  // namespace holdfast
