// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "solver/fit/fit_options.h"
#include "solver/terms/hand/hand_term.h"

namespace holdfast {

/// All terms between one hand and one object in one frame, as one small dense Ceres block.
///
/// Each VertexTerm gives a 3 x 3 Hessian, gradient and cost per hand vertex in the object frame,
/// each SkinTerm gives rows at some of them. The chain rule through z_i = R^T (v_i(P) - T) sums
/// them to one system in 3 + 3 + 45 parameters, whose factor has 51 + 1 rows. Cost, gradient J^T r
/// and Gauss-Newton matrix J^T J equal those of all residuals of all terms; the individual rows
/// have no meaning.
///
/// Parameter blocks: orientation q (4; x y z w; object to world, with RotationManifold),
/// translation T (3, meters, world), fingers P (45, axis-angle, radians). Residuals: 52, square
/// roots of energy. Evaluate returns false when the cost is not finite. `state` must have its body
/// set, must outlive the block, and is modified: use one block per thread.
class HandObjectBlock final : public ceres::CostFunction {
 public:
  static constexpr int kTangent = 6 + kHandDofs;
  static constexpr int kRows = kTangent + 1;

  /// The Gauss-Newton system that the rows factorize.
  struct System {
    Eigen::Matrix<double, kTangent, kTangent> hessian;
    Eigen::Matrix<double, kTangent, 1> gradient;
    double cost;
  };

  explicit HandObjectBlock(HandState* state);
  ~HandObjectBlock() override;

  /// Adds a term whose energy is reported as `kind`; the block does not own it.
  void AddTerm(EnergyTerm kind, const VertexTerm* term) { terms_.push_back({kind, term}); }
  void AddTerm(EnergyTerm kind, SkinTerm* term) { skin_terms_.push_back({kind, term}); }

  /// From now on skin terms select their points in every evaluation, as in Watch: for blocks shared
  /// by several frames of a joint solve.
  void WatchAlways() { watch_always_ = true; }

  /// Discards the last evaluation: call after HandState::SetBody.
  void Invalidate();

  /// Lets the skin terms select their points at these parameters. Returns whether any selection
  /// changed.
  bool Watch(double const* const* parameters);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  /// Energy of each term as in the paper (unweighted).
  const Energies& EnergiesAt(double const* const* parameters) const;

  /// Linearizes at a point, in tangent order (rotation on the right, T, P).
  void Linearize(double const* const* parameters, System& system) const;

 private:
  struct Scratch;
  // Updates the vertices, their positions in the object frame and the terms' quadratics; cached for
  // unchanged parameters, since Ceres evaluates an accepted point twice.
  void Update(double const* const* parameters, bool with_jacobian) const;
  void UpdateRows() const;
  void Chain(System& system) const;
  template <int kFingers>
  void ChainGroup(int g, System& system) const;
  void ChainRows(System& system) const;

  HandState* state_;
  std::vector<std::pair<EnergyTerm, const VertexTerm*>> terms_;
  std::vector<std::pair<EnergyTerm, SkinTerm*>> skin_terms_;
  bool watch_always_ = false;
  mutable std::unique_ptr<Scratch> scratch_;
};

/// Hand vertices in the object frame, z_i = R^T (v_i - T).
Eigen::Matrix3Xd InObjectFrame(const Eigen::Matrix3Xd& vertices, const Eigen::Quaterniond& q,
                               const Eigen::Vector3d& translation);

}  // namespace holdfast
