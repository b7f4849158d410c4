// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// What a term knows of one hand vertex, in Gauss-Newton form. All residuals r that depend on
/// nothing but z_i, the vertex in the object's frame, are summed:
///   cost = 1/2 sum r^2,  gradient = sum r dr/dz,  hessian = sum (dr/dz)^T (dr/dz).
struct VertexQuadratic {
  Eigen::Matrix3d hessian;
  Eigen::Vector3d gradient;
  double cost;
};

/// A term of the fit's energy that sees the hand only through its vertices in the object's frame,
///   z_i = R^T (v_i(P) - T),  meters.
/// Whatever its number of residuals, it costs the solver 3 + 1 numbers a vertex: HandObjectBlock
/// chains them to (R, T, P). To add such a term, derive from this in a header of its own under
/// solver/terms and hand it to HandObjectBlock.
class VertexTerm {
 public:
  virtual ~VertexTerm() = default;

  /// Adds this term's quadratic at each column of `z` (3 x N) to `quadratics` (N), weight included.
  /// Returns the energy as the paper writes it: without weight and without the solver's factor 1/2.
  virtual double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const = 0;
};

/// Residuals of a few points of the skin, each a function of some vertices z in the object's frame:
/// value and gradient, as the rows of a sparse Jacobian. Reused from evaluation to evaluation.
class SkinRows {
 public:
  struct Entry {
    int vertex;
    Eigen::Vector3d gradient;  ///< d residual / d z_vertex, weight included
  };

  void Clear() {
    residuals_.clear();
    ends_.clear();
    entries_.clear();
  }
  /// Begins a row; entries follow by Add.
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

/// A term of the fit's energy that acts at few places of the skin: what touches, what collides.
/// Where VertexTerm sums residuals of every vertex, this adds a row for each residual that is not
/// zero. To add such a term, derive from this in a header of its own under solver/terms and hand it
/// to HandObjectBlock.
class SkinTerm {
 public:
  virtual ~SkinTerm() = default;

  /// Called with the hand where a solve starts, and again where it ended: a term may choose here
  /// which points it looks at until the next call. What it leaves out must be out of its reach.
  /// Returns whether it chose anew.
  virtual bool Watch(const Eigen::Matrix3Xd& z) {
    static_cast<void>(z);
    return false;
  }

  /// Forgets what was chosen: the next Watch chooses anew, whatever came before.
  virtual void Forget() {}

  /// Adds the rows for hand vertices `z` (3 x N, object's frame, meters), weight included.
  /// Returns the energy without weight and without the solver's factor 1/2.
  virtual double Add(const Eigen::Matrix3Xd& z, SkinRows& rows) const = 0;
};

}  // namespace holdfast
