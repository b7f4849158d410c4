// SPDX-License-Identifier: MIT
#include "solver/fit/hand_object_block.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "geometry/rotation.h"
#include "solver/kernels/pair_kernel.h"
#include "solver/unknowns/dense_problem.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {
namespace {

// Upper triangular S with S^T S = M for positive semidefinite M.
Eigen::Matrix3d Factor3(const Eigen::Matrix3d& M) {
  Eigen::Matrix3d S = Eigen::Matrix3d::Zero();
  double pivot = M(0, 0);
  if (pivot > 0.0) {
    const double inverse = 1.0 / std::sqrt(pivot);
    S(0, 0) = pivot * inverse;
    S(0, 1) = M(0, 1) * inverse;
    S(0, 2) = M(0, 2) * inverse;
  }
  pivot = M(1, 1) - S(0, 1) * S(0, 1);
  if (pivot > 1e-14 * M(1, 1)) {
    S(1, 1) = std::sqrt(pivot);
    S(1, 2) = (M(1, 2) - S(0, 1) * S(0, 2)) / S(1, 1);
  }
  pivot = M(2, 2) - S(0, 2) * S(0, 2) - S(1, 2) * S(1, 2);
  if (pivot > 1e-14 * M(2, 2)) S(2, 2) = std::sqrt(pivot);
  return S;
}

}  // namespace

struct HandObjectBlock::Scratch {
  std::array<double, 4 + 3 + kHandDofs> point;  // parameters of the data below
  bool valid = false;
  bool rows_valid = false;  // of skin terms, whose points may change while the rest stays
  bool has_jacobian = false;
  std::array<double, 4 + 3 + kHandDofs> linearized;  // parameters of the last Jacobians
  std::optional<Energies> linearized_energies;
  Eigen::Matrix3d rotation;
  Eigen::Matrix3Xd arms;  // v_i - T, world
  Eigen::Matrix3Xd z;
  std::vector<VertexQuadratic> quadratics;
  SkinRows rows;
  std::vector<double> dense_rows;  // (rows x 56): the chained rows of skin terms
  Energies vertex_energies, energies;
  Isa isa = BestIsa();
  System system;
  RowMajorMatrix factor;  // of the system: the rows passed to Ceres
  Eigen::VectorXd factor_residuals = Eigen::VectorXd(kRows);
};

HandObjectBlock::HandObjectBlock(HandState* state)
    : state_(state), scratch_(std::make_unique<Scratch>()) {
  set_num_residuals(kRows);
  *mutable_parameter_block_sizes() = {4, 3, kHandDofs};
  scratch_->quadratics.resize(static_cast<std::size_t>(state->Hand().NumVertices()));
}

HandObjectBlock::~HandObjectBlock() = default;

void HandObjectBlock::Invalidate() {
  scratch_->valid = false;
  scratch_->linearized_energies.reset();
}

void HandObjectBlock::Update(double const* const* parameters, bool with_jacobian) const {
  Scratch& s = *scratch_;
  std::array<double, 4 + 3 + kHandDofs> point;
  std::copy_n(parameters[0], 4, point.begin());
  std::copy_n(parameters[1], 3, point.begin() + 4);
  std::copy_n(parameters[2], kHandDofs, point.begin() + 7);
  const bool same = s.valid && point == s.point;
  if (same && !s.rows_valid) UpdateRows();
  if (same && (s.has_jacobian || !with_jacobian)) {
    if (with_jacobian) s.linearized_energies = s.energies;
    return;
  }
  s.has_jacobian = with_jacobian;
  if (same) {
    s.linearized = point;
    s.linearized_energies = s.energies;
  }
  if (same && state_->Fingers() == Eigen::Map<const FingerPose>(parameters[2])) {
    state_->EvaluateJacobians();
    return;
  }
  state_->Evaluate(Eigen::Map<const FingerPose>(parameters[2]), with_jacobian);
  s.point = point;
  s.valid = true;
  s.rotation = Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix();
  s.arms = state_->Vertices().colwise() - Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  s.z.noalias() = s.rotation.transpose() * s.arms;
  const VertexQuadratic nothing{Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero(), 0.0};
  std::ranges::fill(s.quadratics, nothing);
  s.vertex_energies = {};
  for (const auto& [kind, term] : terms_) s.vertex_energies[kind] += term->Add(s.z, s.quadratics);
  UpdateRows();
  if (with_jacobian) {
    s.linearized = s.point;
    s.linearized_energies = s.energies;
  }
}

void HandObjectBlock::UpdateRows() const {
  Scratch& s = *scratch_;
  s.rows.Clear();
  s.energies = s.vertex_energies;
  if (watch_always_) {
    for (const auto& [kind, term] : skin_terms_) term->Watch(s.z);
  }
  for (const auto& [kind, term] : skin_terms_) s.energies[kind] += term->Add(s.z, s.rows);
  s.rows_valid = true;
}

bool HandObjectBlock::Watch(double const* const* parameters) {
  if (skin_terms_.empty()) return false;
  Update(parameters, false);
  bool anew = false;
  for (const auto& [kind, term] : skin_terms_) anew |= term->Watch(scratch_->z);
  if (anew) {
    scratch_->rows_valid = false;
    scratch_->linearized_energies.reset();
  }
  return anew;
}

const Energies& HandObjectBlock::EnergiesAt(double const* const* parameters) const {
  // A solver's last point is usually the last one it linearized at, not the last one it tried.
  const Scratch& s = *scratch_;
  const auto at = [&](int block, int size, int begin) {
    return std::equal(parameters[block], parameters[block] + size, s.linearized.begin() + begin);
  };
  if (s.linearized_energies && at(0, 4, 0) && at(1, 3, 4) && at(2, kHandDofs, 7)) {
    return *s.linearized_energies;
  }
  Update(parameters, false);
  return s.energies;
}

// Chain rule for the vertices of one group, which depend on `kFingers` finger parameters (fixed, so
// that the small products unroll). In the object frame dz = [z]x delta - R^T dT + R^T dv.
template <int kFingers>
void HandObjectBlock::ChainGroup(int g, System& system) const {
  constexpr int kColumns = 6 + kFingers;
  constexpr int kWidth = (kColumns + 7) / 8 * 8;  // zero-padded to a whole vector
  constexpr int kVerticesAtOnce = 20;             // their rows stay in the L1 cache
  using Row3 = Eigen::Matrix<double, 3, kWidth, Eigen::RowMajor>;
  Scratch& s = *scratch_;
  const HandModel::Group& group = state_->Hand().Groups()[g];
  const JacobianMatrix& J_fingers = state_->GroupJacobian(g);
  const Eigen::Matrix3d world_to_object = s.rotation.transpose();
  Eigen::Matrix<double, kWidth, kWidth, Eigen::RowMajor> hessian;
  hessian.setZero();
  Eigen::Matrix<double, kColumns, 1> gradient;
  gradient.setZero();
  alignas(64) double rows[3 * kVerticesAtOnce * kWidth] = {};
  Eigen::Matrix3d factors[kVerticesAtOnce];
  const auto count = static_cast<int>(group.vertices.size());
  for (int begin = 0; begin < count; begin += kVerticesAtOnce) {
    const int end = std::min(begin + kVerticesAtOnce, count);
    // All factors first: independent chains of roots and quotients that the processor can overlap.
    for (int m = begin; m < end; ++m) {
      const int i = group.vertices[m];
      factors[m - begin] = Factor3(s.quadratics[i].hessian);
    }
    for (int m = begin; m < end; ++m) {
      const int i = group.vertices[m];
      const VertexQuadratic& quadratic = s.quadratics[i];
      const Eigen::Vector3d z = s.z.col(i);
      system.cost += quadratic.cost;
      const Eigen::Matrix3d& factor = factors[m - begin];
      const Eigen::Matrix3d factor_world = factor * world_to_object;
      const Eigen::Vector3d gradient_world = s.rotation * quadratic.gradient;
      Eigen::Map<Row3> row(rows + 3 * (m - begin) * kWidth);
      for (int k = 0; k < 3; ++k) {
        // Row k of factor [z]x is row_k x z.
        row.template block<1, 3>(k, 0) = Eigen::Vector3d(factor.row(k)).cross(z).transpose();
      }
      row.template block<3, 3>(0, 3) = -factor_world;
      gradient.template head<3>() += quadratic.gradient.cross(z);
      gradient.template segment<3>(3) -= gradient_world;
      if constexpr (kFingers > 0) {
        const Eigen::Map<const Eigen::Matrix<double, 3, kFingers, Eigen::RowMajor>> J(
            J_fingers.data() + 3 * static_cast<Eigen::Index>(m) * kFingers);
        row.template middleCols<kFingers>(6).noalias() = factor_world.lazyProduct(J);
        gradient.template tail<kFingers>().noalias() += J.transpose().lazyProduct(gradient_world);
      }
    }
    RankUpdate(s.isa, rows, 3 * (end - begin), kWidth, hessian.data());
  }

  // Scatter: column c of the group is column place(c) of the system; lower triangle only.
  const auto place = [&](int c) {
    return c < 6 ? c : 6 + 3 * group.joints[static_cast<std::size_t>(c - 6) / 3] + (c - 6) % 3;
  };
  for (int c = 0; c < kColumns; ++c) {
    system.gradient(place(c)) += gradient(c);
    for (int r = c; r < kColumns; ++r) system.hessian(place(r), place(c)) += hessian(c, r);
  }
}

// Rows of skin terms are few and involve arbitrary vertices, so they are stored in full width.
void HandObjectBlock::ChainRows(System& system) const {
  constexpr int kWidth = (kTangent + 7) / 8 * 8;
  Scratch& s = *scratch_;
  const auto count = static_cast<int>(s.rows.Size());
  if (count == 0) return;
  s.dense_rows.assign(static_cast<std::size_t>(count) * kWidth, 0.0);
  for (int k = 0; k < count; ++k) {
    const auto index = static_cast<std::size_t>(k);
    double* const dense = s.dense_rows.data() + index * kWidth;
    Eigen::Map<Eigen::Matrix<double, kTangent, 1>> row(dense);
    for (const SkinRows::Entry* entry = s.rows.begin(index); entry != s.rows.end(index); ++entry) {
      const Eigen::Vector3d in_world = s.rotation * entry->gradient;
      row.head<3>() += entry->gradient.cross(s.z.col(entry->vertex));
      row.segment<3>(3) -= in_world;
      state_->AddJacobianRow(entry->vertex, in_world, dense + 6);
    }
    const double residual = s.rows.Residual(index);
    system.gradient += residual * row;
    system.cost += 0.5 * residual * residual;
  }
  alignas(64) double product[kWidth * kWidth] = {};
  RankUpdate(s.isa, s.dense_rows.data(), count, kWidth, product);
  for (int r = 0; r < kTangent; ++r) {
    for (int c = 0; c <= r; ++c) system.hessian(r, c) += product[c * kWidth + r];
  }
}

void HandObjectBlock::Chain(System& system) const {
  system.hessian.setZero();
  system.gradient.setZero();
  system.cost = 0.0;
  const std::vector<HandModel::Group>& groups = state_->Hand().Groups();
  for (int g = 0; g < static_cast<int>(groups.size()); ++g) {
    switch (groups[g].joints.size()) {
      case 0:
        ChainGroup<0>(g, system);
        break;
      case 3:
        ChainGroup<9>(g, system);
        break;
      default:
        ChainGroup<kHandDofs>(g, system);
        break;
    }
  }
  ChainRows(system);
  system.hessian.triangularView<Eigen::StrictlyUpper>() = system.hessian.transpose();
}

void HandObjectBlock::Linearize(double const* const* parameters, System& system) const {
  Update(parameters, true);
  Chain(system);
}

bool HandObjectBlock::Evaluate(double const* const* parameters, double* residuals,
                               double** jacobians) const {
  Scratch& s = *scratch_;
  Update(parameters, jacobians != nullptr);
  double cost = 0.0;
  for (const VertexQuadratic& quadratic : s.quadratics) cost += quadratic.cost;
  for (std::size_t k = 0; k < s.rows.Size(); ++k) {
    cost += 0.5 * s.rows.Residual(k) * s.rows.Residual(k);
  }
  if (!std::isfinite(cost)) return false;
  Eigen::Map<Eigen::Matrix<double, kRows, 1>> r(residuals);
  if (jacobians == nullptr) {
    // Without a Jacobian, Ceres uses only the norm of the residuals.
    r.setZero();
    r(0) = std::sqrt(2.0 * cost);
    return true;
  }
  Chain(s.system);
  RowMajorMatrix& J = s.factor;
  CompressNormalEquations(s.system.hessian, s.system.gradient, s.system.cost, J,
                          s.factor_residuals);
  r = s.factor_residuals;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, kRows, 4, Eigen::RowMajor>> J_orientation(jacobians[0]);
    J_orientation.topRows<kTangent>() = RotationManifold::Lift(J.leftCols<3>(), parameters[0]);
    J_orientation.bottomRows<1>().setZero();
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, kRows, 3, Eigen::RowMajor>> J_translation(jacobians[1]);
    J_translation.topRows<kTangent>() = J.middleCols<3>(3);
    J_translation.bottomRows<1>().setZero();
  }
  if (jacobians[2] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, kRows, kHandDofs, Eigen::RowMajor>> J_fingers(jacobians[2]);
    J_fingers.topRows<kTangent>() = J.rightCols<kHandDofs>();
    J_fingers.bottomRows<1>().setZero();
  }
  return true;
}

Eigen::Matrix3Xd InObjectFrame(const Eigen::Matrix3Xd& vertices, const Eigen::Quaterniond& q,
                               const Eigen::Vector3d& translation) {
  return q.toRotationMatrix().transpose() * (vertices.colwise() - translation);
}

}  // namespace holdfast
