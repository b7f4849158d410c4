// SPDX-License-Identifier: MIT
#include "solver/hand_object_block.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/rotation.h"
#include "solver/rotation_manifold.h"

namespace holdfast {
namespace {

using RowsMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Upper S with S^T S = M for a positive semidefinite M. Directions without energy (a contact that
// only acts along one normal, say) get rows of zeros instead of the square root of rounding errors.
template <int kSize>
void SemidefiniteFactor(const Eigen::Matrix<double, kSize, kSize>& M,
                        Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>& S) {
  S = M.template triangularView<Eigen::Upper>();
  for (int k = 0; k < kSize; ++k) {
    const double pivot = S(k, k);
    if (!(pivot > 1e-14 * M(k, k))) {
      S.row(k).setZero();
      continue;
    }
    S.row(k).tail(kSize - k) /= std::sqrt(pivot);
    for (int i = k + 1; i < kSize; ++i) {
      S.row(i).tail(kSize - i) -= S(k, i) * S.row(k).tail(kSize - i);
    }
  }
}

}  // namespace

struct HandObjectBlock::Scratch {
  std::array<double, 4 + 3 + kHandDofs> point;  // parameters of what follows
  bool valid = false;
  bool has_jacobian = false;
  Eigen::Matrix3d rotation;
  Eigen::Matrix3Xd arms;  // v_i - T, world
  Eigen::Matrix3Xd z;
  std::vector<VertexQuadratic> quadratics;
  std::vector<RowsMatrix> rows;  // per group: S_i d(v_i - R o)/d(delta, T, fingers of the group)
  System system;
};

HandObjectBlock::HandObjectBlock(HandState* state)
    : state_(state), scratch_(std::make_unique<Scratch>()) {
  set_num_residuals(kRows);
  *mutable_parameter_block_sizes() = {4, 3, kHandDofs};
  for (const HandModel::Group& group : state->Hand().Groups()) {
    scratch_->rows.emplace_back(3 * static_cast<Eigen::Index>(group.vertices.size()),
                                6 + 3 * static_cast<Eigen::Index>(group.joints.size()));
  }
  scratch_->quadratics.resize(static_cast<std::size_t>(state->Hand().NumVertices()));
}

HandObjectBlock::~HandObjectBlock() = default;

void HandObjectBlock::Invalidate() { scratch_->valid = false; }

void HandObjectBlock::Update(double const* const* parameters, bool with_jacobian) const {
  Scratch& s = *scratch_;
  std::array<double, 4 + 3 + kHandDofs> point;
  std::copy_n(parameters[0], 4, point.begin());
  std::copy_n(parameters[1], 3, point.begin() + 4);
  std::copy_n(parameters[2], kHandDofs, point.begin() + 7);
  const bool same = s.valid && point == s.point;
  if (same && (s.has_jacobian || !with_jacobian)) return;
  state_->Evaluate(Eigen::Map<const FingerPose>(parameters[2]), with_jacobian);
  s.has_jacobian = with_jacobian;
  if (same) return;
  s.point = point;
  s.valid = true;
  s.rotation = Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix();
  s.arms = state_->Vertices().colwise() - Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  s.z.noalias() = s.rotation.transpose() * s.arms;
  const VertexQuadratic nothing{Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero(), 0.0};
  std::ranges::fill(s.quadratics, nothing);
  for (const VertexTerm* term : terms_) term->Add(s.z, s.quadratics);
}

void HandObjectBlock::Chain(System& system) const {
  Scratch& s = *scratch_;
  system.hessian.setZero();
  system.gradient.setZero();
  system.cost = 0.0;
  const std::vector<HandModel::Group>& groups = state_->Hand().Groups();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const HandModel::Group& group = groups[g];
    const JacobianMatrix& J_fingers = state_->GroupJacobian(static_cast<int>(g));
    RowsMatrix& rows = s.rows[g];
    const Eigen::Index fingers = rows.cols() - 6;
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(rows.cols());
    for (std::size_t m = 0; m < group.vertices.size(); ++m) {
      const int i = group.vertices[m];
      const auto row = 3 * static_cast<Eigen::Index>(m);
      const VertexQuadratic& quadratic = s.quadratics[static_cast<std::size_t>(i)];
      system.cost += quadratic.cost;
      // In the object's frame dz = [z]x delta - R^T dT + R^T dv.
      Eigen::Matrix<double, 3, 3, Eigen::RowMajor> factor;
      SemidefiniteFactor<3>(quadratic.hessian, factor);
      const Eigen::Matrix3d factor_world = factor * s.rotation.transpose();
      const Eigen::Vector3d gradient_world = s.rotation * quadratic.gradient;
      rows.block<3, 3>(row, 0).noalias() = factor * Skew(Eigen::Vector3d(s.z.col(i)));
      rows.block<3, 3>(row, 3) = -factor_world;
      gradient.head<3>() += quadratic.gradient.cross(Eigen::Vector3d(s.z.col(i)));
      gradient.segment<3>(3) -= gradient_world;
      if (fingers == 0) continue;
      rows.block(row, 6, 3, fingers).noalias() =
          factor_world.lazyProduct(J_fingers.middleRows<3>(row));
      gradient.tail(fingers).noalias() +=
          J_fingers.middleRows<3>(row).transpose() * gradient_world;
    }
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(rows.cols(), rows.cols());
    hessian.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
    hessian.triangularView<Eigen::StrictlyUpper>() = hessian.transpose();

    system.hessian.topLeftCorner<6, 6>() += hessian.topLeftCorner<6, 6>();
    system.gradient.head<6>() += gradient.head<6>();
    for (std::size_t a = 0; a < group.joints.size(); ++a) {
      const auto from_a = 6 + 3 * static_cast<Eigen::Index>(a);
      const Eigen::Index to_a = 6 + 3 * group.joints[a];
      system.gradient.segment<3>(to_a) += gradient.segment<3>(from_a);
      system.hessian.block<6, 3>(0, to_a) += hessian.block<6, 3>(0, from_a);
      system.hessian.block<3, 6>(to_a, 0) += hessian.block<3, 6>(from_a, 0);
      for (std::size_t b = 0; b < group.joints.size(); ++b) {
        system.hessian.block<3, 3>(to_a, 6 + 3 * group.joints[b]) +=
            hessian.block<3, 3>(from_a, 6 + 3 * static_cast<Eigen::Index>(b));
      }
    }
  }
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
  if (!std::isfinite(cost)) return false;
  Eigen::Map<Eigen::Matrix<double, kRows, 1>> r(residuals);
  if (jacobians == nullptr) {
    // Ceres reads nothing but the norm of residuals that come without a Jacobian.
    r.setZero();
    r(0) = std::sqrt(2.0 * cost);
    return true;
  }
  Chain(s.system);
  // Rows [J r; 0 rest] with J^T J the Hessian, J^T r the gradient and r^T r + rest^2 twice the cost.
  Eigen::Matrix<double, kTangent, kTangent, Eigen::RowMajor> J;
  SemidefiniteFactor<kTangent>(s.system.hessian, J);
  Eigen::Matrix<double, kTangent, 1> projected = s.system.gradient;  // J^T projected = gradient
  for (int k = 0; k < kTangent; ++k) {
    projected(k) = J(k, k) > 0.0 ? projected(k) / J(k, k) : 0.0;
    projected.tail(kTangent - k - 1) -= projected(k) * J.row(k).tail(kTangent - k - 1).transpose();
  }
  r.head<kTangent>() = projected;
  r(kTangent) = std::sqrt(std::max(0.0, 2.0 * s.system.cost - projected.squaredNorm()));
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
