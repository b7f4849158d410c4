// SPDX-License-Identifier: MIT
#include "generator/imos/synthesis_metrics_motion.h"

#include <cmath>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::imos {
namespace {

void RequireComparable(const JointMotion& motion, const JointMotion& reference, int least_frames) {
  for (const JointMotion* one : {&motion, &reference}) {
    if (one->rows() != 3 * kMetricJoints || one->cols() < least_frames) {
      throw Error("joints",
                  fmt::format("are {} x {}, {} x {} or more is needed", one->rows(), one->cols(),
                              3 * kMetricJoints, least_frames),
                  "Give the 22 joints of the body in every key frame");
    }
  }
  if (motion.cols() != reference.cols()) {
    throw Error("joints",
                fmt::format("{} key frames stand against {}", motion.cols(), reference.cols()),
                "Compare motions of one length");
  }
}

// Coordinates of joint j, 3 x T.
Eigen::Matrix3Xd JointOf(const JointMotion& motion, int j) { return motion.middleRows<3>(3 * j); }

template <typename Spread>
double SpreadError(const JointMotion& motion, const JointMotion& reference, const Spread& spread) {
  RequireComparable(motion, reference, 2);
  double square = 0.0;
  for (int j = 0; j < kMetricJoints; ++j) {
    const double off = spread(JointOf(motion, j)) - spread(JointOf(reference, j));
    square += off * off;
  }
  return std::sqrt(square);
}

}  // namespace

double MeanJointError(const JointMotion& motion, const JointMotion& reference) {
  RequireComparable(motion, reference, 1);
  double sum = 0.0;
  for (int j = 0; j < kMetricJoints; ++j) {
    sum += (JointOf(motion, j) - JointOf(reference, j)).colwise().norm().sum();
  }
  return sum / static_cast<double>(kMetricJoints * motion.cols());
}

double AverageVarianceErrorOfCode(const JointMotion& motion, const JointMotion& reference) {
  return SpreadError(motion, reference, [](const Eigen::Matrix3Xd& joint) {
    const double off = joint.sum() - joint.mean();
    return off * off / static_cast<double>(joint.cols() - 1);
  });
}

double AverageVarianceError(const JointMotion& motion, const JointMotion& reference) {
  return SpreadError(motion, reference, [](const Eigen::Matrix3Xd& joint) {
    const Eigen::Vector3d mean = joint.rowwise().mean();
    return (joint.colwise() - mean).squaredNorm() / static_cast<double>(joint.cols() - 1);
  });
}

}  // namespace holdfast::imos
