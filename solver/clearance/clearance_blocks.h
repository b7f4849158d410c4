// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>

#include "solver/clearance/arm_range.h"
#include "solver/clearance/depth_in_body.h"
#include "solver/clearance/hand_closure.h"
#include "solver/clearance/hand_stay.h"

namespace holdfast {

using ArmRows = Eigen::Matrix<double, Eigen::Dynamic, 12, Eigen::RowMajor>;

/// One arm in one frame: DepthInBody, HandStay and ArmRange as a function of the four control
/// points (12 each) around it. `basis`: what each counts.
class ClearanceBlock final : public ceres::CostFunction {
 public:
  ClearanceBlock(const ArmFrame& frame, DepthInBody depth, const HandStay& stay,
                 const ArmRange& range, const Eigen::Vector4d& basis);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  ArmFrame frame_;
  DepthInBody depth_;
  HandStay stay_;
  ArmRange range_;
  Eigen::Vector4d basis_;
};

/// Both arms in one frame: HandClosure as a function of four control points of the right and then
/// four of the left arm (12 each).
class ClosureBlock final : public ceres::CostFunction {
 public:
  ClosureBlock(const ArmFrame& right, const ArmFrame& left, const HandClosure& closure,
               const Eigen::Vector4d& basis);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  ArmFrame right_, left_;
  HandClosure closure_;
  Eigen::Vector4d basis_;
};

}  // namespace holdfast
