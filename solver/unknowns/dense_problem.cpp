// SPDX-License-Identifier: MIT
#include "solver/unknowns/dense_problem.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>

#include <ceres/iteration_callback.h>

#include "geometry/parallel.h"
#include "solver/kernels/pair_kernel.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {
namespace {

// Whether all values are +0 or -0, as in most rows of penetration.
bool IsZero(const double* values, int count) {
  std::uint64_t bits = 0;
  for (int k = 0; k < count; ++k) bits |= std::bit_cast<std::uint64_t>(values[k]);
  return (bits << 1) == 0;
}

// Shared by all problems: it has no state.
ceres::Manifold& SharedRotationManifold() {
  static RotationManifold manifold;
  return manifold;
}

// After each step Ceres has linearized at the current point.
class StopWhereFlat final : public ceres::IterationCallback {
 public:
  StopWhereFlat(const CompressedTerms& terms, double tolerance)
      : terms_(terms), tolerance_(tolerance) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    return terms_.PromisedDecrease() <= tolerance_ * summary.cost
               ? ceres::SOLVER_TERMINATE_SUCCESSFULLY
               : ceres::SOLVER_CONTINUE;
  }

 private:
  const CompressedTerms& terms_;
  double tolerance_;
};

}  // namespace

void CompressNormalEquations(const Eigen::Ref<const Eigen::MatrixXd>& hessian,
                             const Eigen::Ref<const Eigen::VectorXd>& gradient, double cost,
                             RowMajorMatrix& S, Eigen::Ref<Eigen::VectorXd> r) {
  const Eigen::Index n = hessian.rows();
  S = hessian.transpose();
  S.triangularView<Eigen::StrictlyLower>().setZero();
  r.head(n) = gradient;
  double rest = 2.0 * cost;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double pivot = S(k, k);
    // A contact along one normal leaves other directions without energy: avoid square roots of
    // rounding errors there.
    if (!(pivot > 1e-14 * hessian(k, k))) {
      S.row(k).setZero();
      r(k) = 0.0;
      continue;
    }
    auto row = S.row(k).tail(n - k);
    row /= std::sqrt(pivot);
    r(k) /= S(k, k);
    rest -= r(k) * r(k);
    for (Eigen::Index i = k + 1; i < n; ++i) {
      const double factor = S(k, i);
      if (factor == 0.0) continue;
      S.row(i).tail(n - i) -= factor * S.row(k).tail(n - i);
      r(i) -= factor * r(k);
    }
  }
  r(n) = std::sqrt(std::max(0.0, rest));
}

struct CompressedTerms::Scratch {
  Isa isa = BestIsa();
  std::vector<double> residuals, jacobian;
  Eigen::MatrixXd hessian;  // lower triangle
  Eigen::VectorXd gradient;
  double cost = 0.0;
  // Rows with many entries are collected here, `width` apart, for one product.
  std::vector<double> dense, product;
  int width = 0, num_dense = 0;
  std::vector<double> row;
  std::vector<int> places;
  RowMajorMatrix S;
  Eigen::VectorXd r;
};

CompressedTerms::CompressedTerms() = default;
CompressedTerms::~CompressedTerms() = default;

int CompressedTerms::AddBlock(int size, bool rotation) {
  assert(!rotation || size == 4);
  blocks_.push_back({size, rotation ? 3 : size, unknowns_, rotation});
  unknowns_ += blocks_.back().tangent;
  mutable_parameter_block_sizes()->push_back(size);
  set_num_residuals(unknowns_ + 1);
  scratch_.reset();
  return static_cast<int>(blocks_.size()) - 1;
}

void CompressedTerms::AddTerm(const ceres::CostFunction& term, std::vector<int> blocks) {
  assert(blocks.size() == term.parameter_block_sizes().size());
  terms_.push_back({&term, std::move(blocks)});
}

bool CompressedTerms::AddRows(const Term& term, double const* const* parameters,
                              double* const* jacobians) const {
  Scratch& s = *scratch_;
  const auto num_rows = static_cast<std::size_t>(term.cost->num_residuals());
  s.residuals.resize(num_rows);
  struct Part {
    const Block* block;
    const double* jacobian;
    Eigen::Matrix<double, 4, 3> plus;  // of a rotation
  };
  std::vector<const double*> own;
  std::vector<double*> own_jacobians;
  std::vector<Part> parts;
  std::size_t numbers = 0;
  for (const int b : term.blocks) {
    if (jacobians != nullptr && jacobians[b] != nullptr) {
      numbers += num_rows * static_cast<std::size_t>(blocks_[static_cast<std::size_t>(b)].size);
    }
  }
  if (s.jacobian.size() < numbers) s.jacobian.resize(numbers);
  double* next = s.jacobian.data();
  for (const int b : term.blocks) {
    const Block& block = blocks_[static_cast<std::size_t>(b)];
    own.push_back(parameters[b]);
    const bool wanted = jacobians != nullptr && jacobians[b] != nullptr;
    own_jacobians.push_back(wanted ? next : nullptr);
    if (!wanted) continue;
    parts.push_back({&block, next, Eigen::Matrix<double, 4, 3>::Zero()});
    if (block.rotation) parts.back().plus = RotationManifold::PlusJacobianAt(parameters[b]);
    next += num_rows * static_cast<std::size_t>(block.size);
  }
  if (!term.cost->Evaluate(own.data(), s.residuals.data(),
                           jacobians != nullptr ? own_jacobians.data() : nullptr)) {
    return false;
  }
  for (const double r : s.residuals) s.cost += 0.5 * r * r;
  if (parts.empty()) return true;

  // Sort by column, so that one loop runs down the lower triangle.
  std::ranges::sort(parts, {}, [](const Part& part) { return part.block->column; });
  constexpr std::size_t kFew = 10;  // maximum entries of a row that is added directly
  for (std::size_t r = 0; r < num_rows; ++r) {
    std::size_t count = 0;
    for (const auto& [block, jacobian, plus] : parts) {
      const double* J = jacobian + r * static_cast<std::size_t>(block->size);
      if (IsZero(J, block->size)) continue;
      Eigen::RowVector3d turn;
      if (block->rotation) {
        turn = Eigen::Map<const Eigen::RowVector4d>(J) * plus;
        J = turn.data();
      }
      for (int c = 0; c < block->tangent; ++c) {  // branch-free: zeros are overwritten
        s.row[count] = J[c];
        s.places[count] = block->column + c;
        count += J[c] != 0.0 ? 1 : 0;
      }
    }
    const double residual = s.residuals[r];
    for (std::size_t j = 0; j < count; ++j) s.gradient(s.places[j]) += s.row[j] * residual;
    if (count > kFew) {
      s.dense.resize(static_cast<std::size_t>(++s.num_dense) * static_cast<std::size_t>(s.width));
      double* const dense = s.dense.data() + s.dense.size() - s.width;
      std::fill_n(dense, s.width, 0.0);
      for (std::size_t j = 0; j < count; ++j) dense[s.places[j]] = s.row[j];
      continue;
    }
    for (std::size_t j = 0; j < count; ++j) {
      double* const column = s.hessian.col(s.places[j]).data();
      for (std::size_t i = j; i < count; ++i) column[s.places[i]] += s.row[j] * s.row[i];
    }
  }
  return true;
}

bool CompressedTerms::Evaluate(double const* const* parameters, double* residuals,
                               double** jacobians) const {
  const Eigen::Index n = unknowns_;
  if (scratch_ == nullptr) {
    scratch_ = std::make_unique<Scratch>();
    scratch_->hessian.resize(n, n);
    scratch_->gradient.resize(n);
    scratch_->r.resize(n + 1);
    scratch_->row.resize(static_cast<std::size_t>(n) + 1);
    scratch_->places.resize(static_cast<std::size_t>(n) + 1);
    scratch_->width = (unknowns_ + 7) / 8 * 8;
    scratch_->product.resize(static_cast<std::size_t>(scratch_->width * scratch_->width));
  }
  Scratch& s = *scratch_;
  s.cost = 0.0;
  if (jacobians != nullptr) {
    s.hessian.setZero();
    s.gradient.setZero();
    s.num_dense = 0;
    s.dense.clear();
  }
  for (const Term& term : terms_) {
    if (!AddRows(term, parameters, jacobians)) return false;
  }
  if (!std::isfinite(s.cost)) return false;
  Eigen::Map<Eigen::VectorXd> r(residuals, n + 1);
  if (jacobians == nullptr) {
    r.setZero();
    r(0) = std::sqrt(2.0 * s.cost);
    return true;
  }
  std::ranges::fill(s.product, 0.0);
  RankUpdate(s.isa, s.dense.data(), s.num_dense, s.width, s.product.data());
  // The product's upper triangle, row-major, is the lower one, column-major.
  for (Eigen::Index c = 0; c < n; ++c) {
    s.hessian.col(c).tail(n - c) +=
        Eigen::Map<const Eigen::VectorXd>(s.product.data() + c * s.width + c, n - c);
  }
  CompressNormalEquations(s.hessian, s.gradient, s.cost, s.S, s.r);
  r = s.r;
  promised_ = 0.5 * s.r.head(n).squaredNorm();
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    if (jacobians[b] == nullptr) continue;
    const Block& block = blocks_[b];
    Eigen::Map<RowMajorMatrix> J(jacobians[b], n + 1, block.size);
    if (block.rotation) {
      J.topRows(n) = RotationManifold::Lift(s.S.middleCols<3>(block.column), parameters[b]);
    } else {
      J.topRows(n) = s.S.middleCols(block.column, block.size);
    }
    J.row(n).setZero();
  }
  return true;
}

DenseProblem::DenseProblem() = default;
DenseProblem::~DenseProblem() = default;

void DenseProblem::AddParameterBlock(double* x, int size, bool rotation) {
  parameters_.push_back({x, size, rotation, false});
  problem_.reset();
}

void DenseProblem::AddResidualBlock(const ceres::CostFunction& term,
                                    const std::vector<double*>& parameters) {
  terms_.push_back({&term, parameters});
  problem_.reset();
}

void DenseProblem::Build() {
  std::vector<Parameter> blocks = parameters_;
  std::vector<std::vector<int>> places;
  for (const Term& term : terms_) {
    std::vector<int>& own = places.emplace_back();
    for (std::size_t k = 0; k < term.parameters.size(); ++k) {
      auto found = std::ranges::find(blocks, term.parameters[k], &Parameter::x);
      if (found == blocks.end()) {
        blocks.push_back({term.parameters[k], term.cost->parameter_block_sizes()[k], false, true});
        found = blocks.end() - 1;
      }
      own.push_back(static_cast<int>(found - blocks.begin()));
    }
  }
  compressed_ = std::make_unique<CompressedTerms>();
  std::vector<double*> values;
  for (const Parameter& block : blocks) {
    compressed_->AddBlock(block.size, block.rotation);
    values.push_back(block.x);
  }
  for (std::size_t k = 0; k < terms_.size(); ++k) {
    compressed_->AddTerm(*terms_[k].cost, std::move(places[k]));
  }
  ceres::Problem::Options own = BorrowingProblem();
  own.disable_all_safety_checks = true;
  problem_ = std::make_unique<ceres::Problem>(own);
  problem_->AddResidualBlock(compressed_.get(), nullptr, values);
  for (const Parameter& block : blocks) {
    if (block.constant) {
      problem_->SetParameterBlockConstant(block.x);
    } else if (block.rotation) {
      problem_->SetManifold(block.x, &SharedRotationManifold());
    }
  }
}

ceres::Solver::Summary DenseProblem::Solve(const ceres::Solver::Options& options) {
  if (problem_ == nullptr) Build();
  StopWhereFlat flat(*compressed_, options.function_tolerance);
  ceres::Solver::Options with_stop = options;
  with_stop.callbacks.push_back(&flat);
  return SolveQuietly(with_stop, *problem_);
}

}  // namespace holdfast
