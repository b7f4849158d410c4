// SPDX-License-Identifier: MIT
#include "solver/unknowns/dense_minimizer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {
namespace {

// Ceres' constants.
constexpr double kMostRadius = 1e16, kLeastRadius = 1e-32;
constexpr double kLeastDiagonal = 1e-6, kMostDiagonal = 1e32;
constexpr double kLeastGradient = 1e-10, kLeastRatio = 1e-3;
constexpr int kMostInvalid = 5;

// How far the linearization is trusted: the damping is the inverse of the radius.
struct Region {
  double radius, shrink = 2.0;

  void Accept(double ratio) {
    const double t = 2.0 * ratio - 1.0;
    radius = std::min(kMostRadius, radius / std::max(1.0 / 3.0, 1.0 - t * t * t));
    shrink = 2.0;
  }
  void Reject() {
    radius /= shrink;
    shrink *= 2.0;
  }
};

// Either zero, all of them; most rows of penetration are.
bool IsZero(const double* values, int count) {
  std::uint64_t bits = 0;
  for (int k = 0; k < count; ++k) bits |= std::bit_cast<std::uint64_t>(values[k]);
  return (bits << 1) == 0;
}

// Cholesky in place, lower triangle of the scaled matrix; zeros to the left of a row's first number
// stay zeros and cost nothing. False where the matrix is not positive definite.
bool Factor(Eigen::MatrixXd& A) {
  const Eigen::Index n = A.rows();
  for (Eigen::Index k = 0; k < n; ++k) {
    if (!(A(k, k) > 0.0)) return false;
    auto column = A.col(k).tail(n - k);
    column /= std::sqrt(A(k, k));
    for (Eigen::Index i = k + 1; i < n; ++i) {
      const double factor = A(i, k);
      if (factor != 0.0) A.col(i).tail(n - i) -= factor * A.col(k).tail(n - i);
    }
  }
  return true;
}

}  // namespace

void DenseMinimizer::AddBlock(double* x, int size, bool rotation) {
  const int column = blocks_.empty() ? 0 : blocks_.back().column + blocks_.back().tangent;
  blocks_.push_back({x, size, rotation ? 3 : size, column});
}

void DenseMinimizer::AddTerm(const ceres::CostFunction& term, std::vector<double*> parameters) {
  terms_.push_back({&term, nullptr, std::move(parameters), {}, {}, {}, {}, {}, {}});
  terms_.back().residuals.resize(static_cast<std::size_t>(term.num_residuals()));
}

void DenseMinimizer::AddTerm(const NormalTerm& term, std::vector<double*> parameters) {
  terms_.push_back({nullptr, &term, std::move(parameters), {}, {}, {}, {}, {}, {}});
}

void DenseMinimizer::Connect() {
  const Eigen::Index n = blocks_.empty() ? 0 : blocks_.back().column + blocks_.back().tangent;
  hessian_.resize(n, n);
  gradient_.resize(n);
  for (Term& term : terms_) {
    term.blocks.clear();
    std::size_t numbers = 0;
    for (const double* x : term.parameters) {
      const auto found = std::ranges::find(blocks_, x, &Block::x);
      term.blocks.push_back(found == blocks_.end() ? nullptr : &*found);
      if (found != blocks_.end()) numbers += static_cast<std::size_t>(found->size);
    }
    if (term.rows != nullptr) {
      term.jacobian.resize(numbers * term.residuals.size());
      continue;
    }
    term.columns.clear();
    const std::vector<int> tangents = term.normal->TangentSizes();
    for (std::size_t b = 0; b < tangents.size(); ++b) {
      for (int k = 0; k < tangents[b]; ++k) {
        term.columns.push_back(term.blocks[b] == nullptr ? -1 : term.blocks[b]->column + k);
      }
    }
    const auto size = static_cast<Eigen::Index>(term.columns.size());
    term.hessian.resize(size, size);
    term.gradient.resize(size);
  }
}

double DenseMinimizer::Cost() {
  double cost = 0.0;
  for (Term& term : terms_) {
    if (term.normal != nullptr) {
      cost += term.normal->CostAt(term.parameters.data());
      continue;
    }
    if (!term.rows->Evaluate(term.parameters.data(), term.residuals.data(), nullptr)) {
      return std::numeric_limits<double>::infinity();
    }
    for (const double r : term.residuals) cost += 0.5 * r * r;
  }
  return cost;
}

// Rows hold few numbers that are not zero: each adds the products of those.
void DenseMinimizer::AddRows(Term& term) {
  std::vector<double*> jacobians;
  double* next = term.jacobian.data();
  for (const Block* block : term.blocks) {
    jacobians.push_back(block == nullptr ? nullptr : next);
    if (block != nullptr) next += static_cast<std::size_t>(block->size) * term.residuals.size();
  }
  term.rows->Evaluate(term.parameters.data(), term.residuals.data(), jacobians.data());
  // By their columns, so that one loop runs down the lower triangle.
  struct Part {
    const Block* block;
    const double* jacobian;
    Eigen::Matrix<double, 4, 3> plus;  // of a rotation
  };
  std::vector<Part> ascending;
  for (std::size_t b = 0; b < term.blocks.size(); ++b) {
    const Block* const block = term.blocks[b];
    if (block == nullptr) continue;
    ascending.push_back({block, jacobians[b], Eigen::Matrix<double, 4, 3>::Zero()});
    if (block->tangent != block->size) {
      ascending.back().plus = RotationManifold::PlusJacobianAt(block->x);
    }
  }
  std::ranges::sort(ascending, {}, [](const Part& part) { return part.block->column; });
  std::vector<double> value(static_cast<std::size_t>(gradient_.size()) + 1);
  std::vector<Eigen::Index> place(value.size());
  for (std::size_t r = 0; r < term.residuals.size(); ++r) {
    std::size_t count = 0;
    for (const auto& [block, jacobian, plus] : ascending) {
      const double* J = jacobian + r * static_cast<std::size_t>(block->size);
      if (IsZero(J, block->size)) continue;
      Eigen::RowVector3d turn;
      if (block->tangent != block->size) {
        turn = Eigen::Map<const Eigen::RowVector4d>(J) * plus;
        J = turn.data();
      }
      for (int c = 0; c < block->tangent; ++c) {  // without branches: what is zero is overwritten
        value[count] = J[c];
        place[count] = block->column + c;
        count += J[c] != 0.0 ? 1 : 0;
      }
    }
    for (std::size_t j = 0; j < count; ++j) {
      const double factor = value[j];
      gradient_(place[j]) += factor * term.residuals[r];
      double* const column = hessian_.col(place[j]).data();
      for (std::size_t i = j; i < count; ++i) column[place[i]] += factor * value[i];
    }
  }
}

void DenseMinimizer::AddNormal(Term& term) {
  term.normal->NormalEquations(term.parameters.data(), term.hessian, term.gradient);
  for (Eigen::Index c = 0; c < term.gradient.size(); ++c) {
    const int column = term.columns[static_cast<std::size_t>(c)];
    if (column < 0) continue;
    gradient_(column) += term.gradient(c);
    for (Eigen::Index r = 0; r < term.gradient.size(); ++r) {
      const int row = term.columns[static_cast<std::size_t>(r)];
      if (row >= column) hessian_(row, column) += term.hessian(r, c);
    }
  }
}

void DenseMinimizer::Linearize() {
  hessian_.setZero();
  gradient_.setZero();
  for (Term& term : terms_) term.normal != nullptr ? AddNormal(term) : AddRows(term);
}

// The damped Gauss-Newton step, and the decrease of the cost that the linearization promises.
bool DenseMinimizer::FindStep(double radius) {
  const Eigen::Index n = gradient_.size();
  factor_ = hessian_;
  for (Eigen::Index c = 0; c < n; ++c) {
    factor_.col(c).tail(n - c).array() *= scale_(c) * scale_.tail(n - c).array();
  }
  const Eigen::VectorXd damping =
      factor_.diagonal().cwiseMax(kLeastDiagonal).cwiseMin(kMostDiagonal) / radius;
  factor_.diagonal() += damping;
  if (!Factor(factor_)) return false;
  const Eigen::VectorXd gradient = gradient_.cwiseProduct(scale_);
  step_ = -gradient;
  factor_.triangularView<Eigen::Lower>().solveInPlace(step_);
  // With A = H + D and A s = -g: -s'g - s'Hs / 2 = (s'As + s'Ds) / 2.
  decrease_ = 0.5 * step_.squaredNorm();
  factor_.triangularView<Eigen::Lower>().transpose().solveInPlace(step_);
  decrease_ += 0.5 * step_.cwiseAbs2().dot(damping);
  step_.array() *= scale_.array();
  return std::isfinite(decrease_) && decrease_ > 0.0;
}

void DenseMinimizer::Move() {
  before_.clear();
  double squared = 0.0;
  for (const Block& block : blocks_) {
    before_.insert(before_.end(), block.x, block.x + block.size);
    const double* const from = before_.data() + before_.size() - block.size;
    const double* const step = step_.data() + block.column;
    if (block.tangent != block.size) {
      RotationManifold().Plus(from, step, block.x);
    } else {
      for (int k = 0; k < block.size; ++k) block.x[k] += step[k];
    }
    for (int k = 0; k < block.size; ++k) squared += (block.x[k] - from[k]) * (block.x[k] - from[k]);
  }
  length_ = std::sqrt(squared);
}

void DenseMinimizer::Restore() const {
  const double* from = before_.data();
  for (const Block& block : blocks_) {
    std::copy_n(from, block.size, block.x);
    from += block.size;
  }
}

DenseMinimizer::Report DenseMinimizer::Minimize(const Options& options) {
  Connect();
  Report report;
  report.cost = Cost();
  if (!std::isfinite(report.cost)) return report;
  Linearize();
  scale_ = (1.0 + hessian_.diagonal().array().sqrt()).inverse();
  Region region{options.radius};
  int invalid = 0;
  bool moved = false;  // small steps are small against the way only once there was one
  while (report.iterations < options.max_iterations) {
    report.radius = region.radius;
    report.stop = Stop::kConverged;
    if (gradient_.lpNorm<Eigen::Infinity>() <= kLeastGradient || region.radius < kLeastRadius) {
      return report;
    }
    if (!FindStep(region.radius)) {
      report.stop = Stop::kFailed;
      if (++invalid >= kMostInvalid) return report;
      region.Reject();
      continue;
    }
    invalid = 0;
    const double least = options.function_tolerance * report.cost;
    if (decrease_ <= least) return report;
    Move();
    const double size =
        Eigen::Map<const Eigen::VectorXd>(before_.data(), static_cast<Eigen::Index>(before_.size()))
            .norm();
    if (moved && length_ <= options.step_tolerance * (size + options.step_tolerance)) {
      Restore();
      return report;
    }
    const double cost = Cost();
    ++report.iterations;
    const double change = report.cost - cost;
    if (moved && std::abs(change) <= least) {
      Restore();
      return report;
    }
    const double ratio = change / decrease_;
    if (ratio > kLeastRatio) {
      report.cost = cost;
      moved = true;
      Linearize();
      region.Accept(ratio);
    } else {
      Restore();
      region.Reject();
    }
  }
  report.stop = Stop::kIterationLimit;
  return report;
}

}  // namespace holdfast
