// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// A term that knows its normal equations: for those that have the sums over many residuals and
/// would otherwise have to make up rows for a solver to sum again.
class NormalTerm {
 public:
  virtual ~NormalTerm() = default;

  /// Tangent dimensions of the parameter blocks.
  virtual std::vector<int> TangentSizes() const = 0;
  /// Half the sum of squares; not finite where the term cannot be evaluated.
  virtual double CostAt(double const* const* parameters) const = 0;
  /// J^T J (n x n) and J^T r (n) in the tangent spaces of the parameter blocks, one after another.
  /// Both come with their size and are overwritten.
  virtual void NormalEquations(double const* const* parameters, Eigen::Ref<Eigen::MatrixXd> hessian,
                               Eigen::Ref<Eigen::VectorXd> gradient) const = 0;
};

/// Nonlinear least squares in about a hundred unknowns, solved many times a second: Ceres'
/// Levenberg-Marquardt (its trust region, scaling and reasons to stop) on the normal equations,
/// without a problem to build and without rows for what is known as sums. Beyond Ceres it stops
/// before an evaluation whose outcome cannot matter: where the step, or the decrease that it
/// promises, is below the tolerance. Not for use by several threads at a time.
class DenseMinimizer {
 public:
  struct Options {
    int max_iterations = 50;
    double step_tolerance = 1e-5;      ///< of a step against the unknowns
    double function_tolerance = 1e-9;  ///< of a change of the cost against it
    double radius = 1e4;               ///< how far the first linearization is trusted
  };
  enum class Stop { kConverged, kIterationLimit, kFailed };
  struct Report {
    Stop stop = Stop::kFailed;
    int iterations = 0;   ///< steps tried
    double cost = 0.0;    ///< half the sum of squares, at the end
    double radius = 0.0;  ///< that the linearization was trusted at the end
  };

  /// Unknowns of `size` numbers; a rotation is a unit quaternion (x y z w) moved as by
  /// RotationManifold. What is read and written stays the caller's. Blocks whose normal equations
  /// share no term are best added first.
  void AddBlock(double* x, int size, bool rotation = false);
  /// Terms over blocks in the term's own order; those that were not added are constant. Terms must
  /// outlive this.
  void AddTerm(const ceres::CostFunction& term, std::vector<double*> parameters);
  void AddTerm(const NormalTerm& term, std::vector<double*> parameters);

  /// Moves the blocks to a minimum. Where the cost is not finite to begin with, nothing moves and
  /// it fails; afterwards steps that lead there are rejected.
  Report Minimize(const Options& options);

 private:
  struct Block {
    double* x;
    int size, tangent;
    int column;  // of its tangent
  };
  struct Term {
    const ceres::CostFunction* rows;
    const NormalTerm* normal;
    std::vector<double*> parameters;
    std::vector<const Block*> blocks;  // null where constant; set by Minimize
    std::vector<double> residuals, jacobian;
    Eigen::MatrixXd hessian;
    Eigen::VectorXd gradient;
    std::vector<int> columns;  // of each row of those, -1 where constant
  };

  void Connect();
  double Cost();
  void Linearize();
  void AddRows(Term& term);
  void AddNormal(Term& term);
  bool FindStep(double radius);
  void Move();
  void Restore() const;

  std::vector<Block> blocks_;
  std::vector<Term> terms_;
  Eigen::MatrixXd hessian_, factor_;
  Eigen::VectorXd gradient_, scale_, step_;
  std::vector<double> before_;  // of all blocks, where the step began
  double decrease_ = 0.0;       // that the step promises
  double length_ = 0.0;         // of the step, in all numbers of the blocks
};

}  // namespace holdfast
