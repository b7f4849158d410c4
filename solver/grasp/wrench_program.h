// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// Linear program for the amount x >= 0 of each wrench w of a grasp: minimizes the cost of x and of
/// the slacks over, under >= 0, with W x - over + under = load; the sum of x may be bounded. Rows:
/// the six of W and the sum; columns: over and under of each row, then x. Solved by GLPK, or by
/// lp_solve (under the LGPL) in a build with HOLDFAST_GPL=OFF; each solution starts from the last.
class WrenchProgram {
 public:
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  using Wrenches = Eigen::Matrix<double, 6, Eigen::Dynamic>;

  /// Costs of the forces x and of the slacks.
  WrenchProgram(double forces, double missing);
  ~WrenchProgram();

  /// Replaces the wrenches; the basis of the last solution is kept if their number is unchanged.
  void Set(const Wrenches& wrenches);
  void Add(const Vector6d& wrench);
  void SetLoad(const Vector6d& load);
  void SetMostSum(double most);
  /// Returns W x and the sum of x at the optimum, with negative entries of x set to 0 so that x is
  /// exactly feasible. Both are zero if the solver fails.
  std::pair<Vector6d, double> Minimize();
  /// Multipliers of the six load rows at the optimum.
  Vector6d Direction() const;

 private:
  struct Program;

  std::vector<Vector6d> wrenches_;
  std::unique_ptr<Program> program_;
};

}  // namespace holdfast
