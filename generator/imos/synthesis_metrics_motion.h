// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace holdfast::imos {

/// Joints of the body along a motion (66 x T): a column per key frame, joint after joint (x, y, z),
/// meters, in the canonical frame. Joints 0 to 21 of SMPL-X.
using JointMotion = Eigen::MatrixXd;

inline constexpr int kMetricJoints = 22;

/// Mean over frames and joints of ||p - q||, meters (MPJPE; "mean APE" in the authors' code).
/// Throws Error, as all here do, for motions of different sizes or not of 66 rows.
double MeanJointError(const JointMotion& motion, const JointMotion& reference);

/// AVE as the authors' code has it: per joint s = (S - S / (3 T))^2 / (T - 1), S the sum of all its
/// 3 T coordinates; ||s - s'|| over the 22 joints. No variance: it grows with where the motion is.
/// T of at least 2.
double AverageVarianceErrorOfCode(const JointMotion& motion, const JointMotion& reference);

/// AVE as it is defined (Ghosh et al. 2021): per joint the variance of its place,
/// s = 1 / (T - 1) sum_t ||p_t - mean||^2, m^2; ||s - s'|| over the 22 joints. T of at least 2.
double AverageVarianceError(const JointMotion& motion, const JointMotion& reference);

}  // namespace holdfast::imos
