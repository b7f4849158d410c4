// SPDX-License-Identifier: MIT
#include "solver/latent/motion_objective.h"

#include <algorithm>

#include "geometry/body/skeleton.h"

namespace holdfast {
namespace {

using RowMajor3 = MotionView::RowMajor3;

// The vector v with <G, [e_i]x> = v_i.
Eigen::Vector3d Axial(const Eigen::Matrix3d& G) {
  return {G(2, 1) - G(1, 2), G(0, 2) - G(2, 0), G(1, 0) - G(0, 1)};
}

void AddToGradient(const MotionQuantity& quantity, const MotionView& motion, const double* bar,
                   MotionGradient& gradient) {
  const MotionView::Frame& frame = motion.FrameAt(quantity.frame);
  auto pose_bar = gradient.poses.col(quantity.frame);
  // Rotating a joint rotates its descendants: d / d phi_j = A_j^T couple, for j up to the root.
  const auto add_couple = [&](int joint, const Eigen::Vector3d& couple) {
    for (int j = joint;; j = kJointParents[j]) {
      pose_bar.segment<3>(wandr::TangentOf(j)) += frame.world[j].transpose() * couple;
      if (j == 0) return;
    }
  };
  switch (quantity.kind) {
    case MotionQuantity::Kind::kPosition: {
      const Eigen::Map<const Eigen::Vector3d> force(bar);
      int joint = quantity.joint;
      if (joint >= kNumBodyJoints) {
        joint = motion.Point(quantity.joint).joint;
        const Eigen::Vector3d arm =
            frame.positions.col(quantity.joint) - frame.positions.col(joint);
        add_couple(joint, arm.cross(Eigen::Vector3d(force)));
      }
      gradient.joints.block<3, 1>(3 * joint, quantity.frame) += force;
      return;
    }
    case MotionQuantity::Kind::kLocalRotation: {
      // R exp(phi): dR = R [phi]x.
      const Eigen::Matrix3d G = Eigen::Map<const RowMajor3>(bar);
      const RowMajor3& R = frame.local[quantity.joint];
      pose_bar.segment<3>(wandr::TangentOf(quantity.joint)) += Axial(R.transpose() * G);
      return;
    }
    case MotionQuantity::Kind::kWorldRotation: {
      // dA = [omega]x A.
      const Eigen::Matrix3d G = Eigen::Map<const RowMajor3>(bar);
      const RowMajor3& A = frame.world[quantity.joint];
      add_couple(quantity.joint, Axial(G * A.transpose()));
      return;
    }
  }
}

}  // namespace

template <typename T>
void MotionView::Set(int frame, const wandr::Pose<T>& pose,
                     const wandr::BoneOffsets<double>& bones) {
  wandr::BodyKinematics<double> kinematics;
  const wandr::Pose<double> exact = pose.template Cast<double>();
  wandr::ForwardKinematics(bones, exact, kinematics);
  Frame& out = frames_[frame];
  out.positions.resize(3, kNumBodyJoints + static_cast<Eigen::Index>(points_.size()));
  out.positions.leftCols<kNumBodyJoints>() = kinematics.joints;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const auto joint = static_cast<std::size_t>(points_[i].joint);
    out.positions.col(kNumBodyJoints + static_cast<Eigen::Index>(i)) =
        kinematics.joints.col(points_[i].joint) + kinematics.world[joint] * points_[i].offset;
  }
  for (std::size_t k = 0; k < kNumBodyJoints; ++k) {
    out.local[k] = exact.rotation[k];
    out.world[k] = kinematics.world[k];
  }
}

const double* MotionView::Data(const MotionQuantity& quantity) const {
  const Frame& frame = FrameAt(quantity.frame);
  const auto joint = static_cast<std::size_t>(quantity.joint);
  switch (quantity.kind) {
    case MotionQuantity::Kind::kPosition:
      return frame.positions.col(quantity.joint).data();
    case MotionQuantity::Kind::kLocalRotation:
      return frame.local[joint].data();
    case MotionQuantity::Kind::kWorldRotation:
      return frame.world[joint].data();
  }
  return nullptr;
}

void MotionObjective::Add(std::string_view term, std::shared_ptr<const ceres::CostFunction> cost,
                          std::shared_ptr<const ceres::LossFunction> loss,
                          std::vector<MotionQuantity> blocks) {
  const auto known = std::ranges::find(terms_, term);
  const auto index = static_cast<int>(known - terms_.begin());
  if (known == terms_.end()) terms_.emplace_back(term);
  blocks_.push_back({index, std::move(cost), std::move(loss), std::move(blocks)});
}

double MotionObjective::Evaluate(const MotionView& motion, MotionGradient* gradient,
                                 std::map<std::string, double>* by_term) const {
  std::vector<const double*> parameters;
  std::vector<double> residuals, jacobian_store, bar;
  std::vector<double*> jacobians;
  std::vector<double> sums(terms_.size(), 0.0);
  for (const Block& block : blocks_) {
    const std::size_t count = block.quantities.size();
    const auto rows = static_cast<std::size_t>(block.cost->num_residuals());
    parameters.resize(count);
    residuals.resize(rows);
    std::size_t width = 0;
    for (std::size_t k = 0; k < count; ++k) {
      parameters[k] = motion.Data(block.quantities[k]);
      width += static_cast<std::size_t>(block.quantities[k].Size());
    }
    double** wanted = nullptr;
    if (gradient != nullptr) {
      jacobian_store.resize(rows * width);
      jacobians.resize(count);
      double* at = jacobian_store.data();
      for (std::size_t k = 0; k < count; ++k) {
        jacobians[k] = at;
        at += rows * static_cast<std::size_t>(block.quantities[k].Size());
      }
      wanted = jacobians.data();
    }
    if (!block.cost->Evaluate(parameters.data(), residuals.data(), wanted)) continue;
    double squared = 0.0;
    for (std::size_t r = 0; r < rows; ++r) squared += residuals[r] * residuals[r];
    double rho[3] = {squared, 1.0, 0.0};
    if (block.loss != nullptr) block.loss->Evaluate(squared, rho);
    sums[block.term] += 0.5 * rho[0];
    if (gradient == nullptr || squared == 0.0) continue;
    for (std::size_t k = 0; k < count; ++k) {
      const auto size = static_cast<std::size_t>(block.quantities[k].Size());
      bar.assign(size, 0.0);
      for (std::size_t r = 0; r < rows; ++r) {
        const double pull = rho[1] * residuals[r];
        for (std::size_t c = 0; c < size; ++c) bar[c] += pull * jacobians[k][r * size + c];
      }
      AddToGradient(block.quantities[k], motion, bar.data(), *gradient);
    }
  }
  double total = 0.0;
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    total += sums[t];
    if (by_term != nullptr) (*by_term)[terms_[t]] += sums[t];
  }
  return total;
}

template void MotionView::Set<float>(int, const wandr::Pose<float>&,
                                     const wandr::BoneOffsets<double>&);
template void MotionView::Set<double>(int, const wandr::Pose<double>&,
                                      const wandr::BoneOffsets<double>&);

}  // namespace holdfast
