// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// Gauss-Newton form of a term at one hand vertex: sums over all residuals r that depend only on
/// z_i, the vertex in the object frame:
///   cost = 1/2 sum r^2,  gradient = sum r dr/dz,  hessian = sum (dr/dz)^T (dr/dz).
struct VertexQuadratic {
  Eigen::Matrix3d hessian;
  Eigen::Vector3d gradient;
  double cost;
};

/// A term of the fit's energy that sees the hand only through its vertices in the object frame,
///   z_i = R^T (v_i(P) - T),  meters.
/// Any number of residuals costs the solver 3 + 1 numbers per vertex: HandObjectBlock chains them
/// to (R, T, P). To add a term, derive from this in a separate header in solver/terms and pass it
/// to HandObjectBlock.
class VertexTerm {
 public:
  virtual ~VertexTerm() = default;

  /// Adds this term's quadratic at each column of `z` (3 x N) to `quadratics` (N), weight included.
  /// Returns the energy as in the paper: without weight and without the solver's factor 1/2.
  virtual double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const = 0;
};

/// Residuals at a few skin points, each a function of some vertices z in the object frame: value
/// and gradient, as rows of a sparse Jacobian. Reused between evaluations.
class SkinRows {
 public:
  struct Entry {
    int vertex;
    Eigen::Vector3d gradient;  ///< d residual / d z_vertex, including the weight
  };

  void Clear() {
    residuals_.clear();
    ends_.clear();
    entries_.clear();
  }
  /// Begins a row; Add appends its entries.
  void Begin(double residual) {
    residuals_.push_back(residual);
    ends_.push_back(entries_.size());
  }
  void Add(int vertex, const Eigen::Vector3d& gradient) {
    entries_.push_back({vertex, gradient});
    ends_.back() = entries_.size();
  }

  std::size_t Size() const { return residuals_.size(); }
  double Residual(std::size_t row) const { return residuals_[row]; }
  const Entry* begin(std::size_t row) const {
    return entries_.data() + (row == 0 ? 0 : ends_[row - 1]);
  }
  const Entry* end(std::size_t row) const { return entries_.data() + ends_[row]; }

 private:
  std::vector<double> residuals_;
  std::vector<std::size_t> ends_;
  std::vector<Entry> entries_;
};

/// A term of the fit's energy that acts at few skin points, such as contact or collision. Where
/// VertexTerm sums the residuals of every vertex, this adds a row for each nonzero residual. To add
/// such a term, derive from this class in a separate header under solver/terms and pass it to
/// HandObjectBlock.
class SkinTerm {
 public:
  virtual ~SkinTerm() = default;

  /// Called with the hand at the start of a solve, and again at its end: a term may select the
  /// points that it evaluates until the next call. Omitted points must be out of its reach. Returns
  /// whether the selection changed.
  virtual bool Watch(const Eigen::Matrix3Xd& z) {
    static_cast<void>(z);
    return false;
  }

  /// Discards the selection: the next Watch selects again in any case.
  virtual void Forget() {}

  /// Adds the rows for hand vertices `z` (3 x N, object frame, meters), including the weight.
  /// Returns the energy without weight and without the solver's factor 1/2.
  virtual double Add(const Eigen::Matrix3Xd& z, SkinRows& rows) const = 0;
};

}  // namespace holdfast
