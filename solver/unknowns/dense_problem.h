// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Core>

namespace holdfast {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Computes an upper triangular least squares problem for given normal equations: S (n x n) and r
/// (n + 1) with S^T S = `hessian`, S^T r = `gradient` and |r|^2 = 2 `cost`. Reads the lower
/// triangle of `hessian`. Directions without energy get rows of zeros.
void CompressNormalEquations(const Eigen::Ref<const Eigen::MatrixXd>& hessian,
                             const Eigen::Ref<const Eigen::VectorXd>& gradient, double cost,
                             RowMajorMatrix& S, Eigen::Ref<Eigen::VectorXd> r);

/// Combines several cost functions over the same few parameter blocks into one, with one row more
/// than there are unknowns. A dense Ceres solver has a cost per row; this sums J^T J and J^T r over
/// all rows, skips their zeros (limits and penetration are mostly zeros) and returns the Cholesky
/// factor. Cost, gradient and Gauss-Newton matrix equal those of separate residual blocks; single
/// residuals have no meaning. Without Jacobians only the norm of the residuals is correct, which is
/// all that Ceres reads then. Not thread-safe.
class CompressedTerms final : public ceres::CostFunction {
 public:
  CompressedTerms();
  ~CompressedTerms() override;

  /// Adds a parameter block of `size` entries and returns its index. A rotation is a unit
  /// quaternion (x, y, z, w) with RotationManifold; its 4 entries have 3 degrees of freedom.
  int AddBlock(int size, bool rotation);
  /// Adds a term over blocks given by index, in the term's order. It must outlive this.
  void AddTerm(const ceres::CostFunction& term, std::vector<int> blocks);

  /// Returns false if a term does or the cost is not finite.
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  /// Predicted cost decrease to the minimum of the linearization at the last evaluated Jacobians:
  /// half the square of all residuals but the last.
  double PromisedDecrease() const { return promised_; }

 private:
  struct Block {
    int size, tangent, column;
    bool rotation;
  };
  struct Term {
    const ceres::CostFunction* cost;
    std::vector<int> blocks;
  };
  bool AddRows(const Term& term, double const* const* parameters, double* const* jacobians) const;

  std::vector<Block> blocks_;
  std::vector<Term> terms_;
  int unknowns_ = 0;
  mutable double promised_ = 0.0;
  struct Scratch;
  mutable std::unique_ptr<Scratch> scratch_;
};

/// A ceres::Problem of about a hundred unknowns, to be solved many times per second: its terms are
/// compressed (CompressedTerms), so that Ceres sees one residual block.
class DenseProblem {
 public:
  DenseProblem();
  ~DenseProblem();
  DenseProblem(const DenseProblem&) = delete;
  DenseProblem& operator=(const DenseProblem&) = delete;

  /// Adds unknowns; a rotation is a unit quaternion (x, y, z, w) with RotationManifold.
  void AddParameterBlock(double* x, int size, bool rotation = false);
  /// Adds a term, which must outlive this. Parameters that are never added as parameter blocks are
  /// constant.
  void AddResidualBlock(const ceres::CostFunction& term, const std::vector<double*>& parameters);

  /// ceres::Solve, which also ends successfully when the linearization predicts no more decrease
  /// than the function tolerance, which avoids useless evaluations. May be called again after
  /// parameters or terms changed in place.
  ceres::Solver::Summary Solve(const ceres::Solver::Options& options);

 private:
  struct Parameter {
    double* x;
    int size;
    bool rotation, constant;
  };
  struct Term {
    const ceres::CostFunction* cost;
    std::vector<double*> parameters;
  };
  void Build();

  std::vector<Parameter> parameters_;
  std::vector<Term> terms_;
  // Built from these by the first Solve after an addition.
  std::unique_ptr<CompressedTerms> compressed_;
  std::unique_ptr<ceres::Problem> problem_;
};

}  // namespace holdfast
