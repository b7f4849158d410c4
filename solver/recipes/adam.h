// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace holdfast {

/// Adam (Kingma and Ba 2015, algorithm 1) with the customary constants. Moments are kept from call
/// to call until Reset.
class ReferenceAdam {
 public:
  explicit ReferenceAdam(Eigen::Index size)
      : mean_(Eigen::VectorXd::Zero(size)), square_(Eigen::VectorXd::Zero(size)) {}

  void Step(const Eigen::VectorXd& gradient, double learning_rate, Eigen::VectorXd& x) {
    constexpr double kMean = 0.9, kSquare = 0.999, kEpsilon = 1e-8;
    ++steps_;
    mean_ = kMean * mean_ + (1.0 - kMean) * gradient;
    square_ = kSquare * square_ + (1.0 - kSquare) * gradient.cwiseAbs2();
    const double mean_scale = 1.0 / (1.0 - std::pow(kMean, steps_));
    const double square_scale = 1.0 / (1.0 - std::pow(kSquare, steps_));
    x.array() -= learning_rate * mean_scale * mean_.array() /
                 ((square_scale * square_.array()).sqrt() + kEpsilon);
  }

  void Reset() {
    mean_.setZero();
    square_.setZero();
    steps_ = 0;
  }

 private:
  Eigen::VectorXd mean_, square_;
  int steps_ = 0;
};

}  // namespace holdfast
