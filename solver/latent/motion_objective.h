// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <Eigen/Core>

#include "generator/wandr/pose.h"

namespace holdfast {

/// A point of the body, fixed to a joint's frame.
struct BodyPoint {
  int joint = 0;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< meters, in the joint's frame
};

/// A quantity that residual blocks of a motion may depend on.
struct MotionQuantity {
  enum class Kind {
    kPosition,       ///< of a joint, or for >= 22 of a BodyPoint: 3 values, world, meters
    kLocalRotation,  ///< of a joint relative to its parent: 9 values, row-major
    kWorldRotation,  ///< of a joint to the world: 9 values, row-major
  };
  Kind kind = Kind::kPosition;
  int frame = 0;
  int joint = 0;

  int Size() const { return kind == Kind::kPosition ? 3 : 9; }
};

/// Position of a joint, or for >= 22 of a point.
inline MotionQuantity Position(int frame, int joint) {
  return {MotionQuantity::Kind::kPosition, frame, joint};
}
inline MotionQuantity LocalRotation(int frame, int joint) {
  return {MotionQuantity::Kind::kLocalRotation, frame, joint};
}
inline MotionQuantity WorldRotation(int frame, int joint) {
  return {MotionQuantity::Kind::kWorldRotation, frame, joint};
}

/// A motion as seen by the terms: positions and rotations of all joints, in double.
class MotionView {
 public:
  /// `points` are joints 22, 23, .. for kPosition.
  explicit MotionView(std::vector<BodyPoint> points = {}) : points_(std::move(points)) {}

  /// Sets a frame in 0..T of one body.
  template <typename T>
  void Set(int frame, const wandr::Pose<T>& pose, const wandr::BoneOffsets<double>& bones);
  void Resize(int num_frames) { frames_.resize(static_cast<std::size_t>(num_frames)); }

  int NumFrames() const { return static_cast<int>(frames_.size()); }
  /// Position of a joint, or for >= 22 of a point.
  Eigen::Vector3d At(int frame, int joint) const { return frames_[frame].positions.col(joint); }
  const double* Data(const MotionQuantity& quantity) const;

  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  struct Frame {
    Eigen::Matrix3Xd positions;  // joints, then points
    std::array<RowMajor3, kNumBodyJoints> local, world;
  };
  const Frame& FrameAt(int frame) const { return frames_[frame]; }
  const BodyPoint& Point(int joint) const { return points_[joint - kNumBodyJoints]; }

 private:
  std::vector<BodyPoint> points_;
  std::vector<Frame> frames_;
};

/// Derivative of a scalar with respect to a motion: per frame, by joint position and by pose
/// (tangents, wandr::TangentVector); a wandr::RolloutSeed of one body.
struct MotionGradient {
  Eigen::MatrixXd joints;  ///< (66 x F)
  Eigen::MatrixXd poses;   ///< (69 x F)

  void SetZero(int num_frames) {
    joints.setZero(wandr::kJointNumbers, num_frames);
    poses.setZero(wandr::kTangentSize, num_frames);
  }
};

/// A sum of Ceres residual blocks over a motion, sum_b rho_b(|r_b|^2) / 2, and its gradient. Unlike
/// in ceres::Problem, the unknowns are latents behind a rollout: instead of a Jacobian, it gives
/// the gradient that the rollout's Backward propagates to them. Const use is thread-safe.
class MotionObjective {
 public:
  /// `cost` may be shared by many blocks; `loss` may be null (squared). `term` names the block's
  /// part of the sum.
  void Add(std::string_view term, std::shared_ptr<const ceres::CostFunction> cost,
           std::shared_ptr<const ceres::LossFunction> loss, std::vector<MotionQuantity> blocks);

  /// Returns the value; adds to `gradient` (sized for the motion) if not null, and to `by_term`.
  double Evaluate(const MotionView& motion, MotionGradient* gradient = nullptr,
                  std::map<std::string, double>* by_term = nullptr) const;

  std::size_t NumBlocks() const { return blocks_.size(); }
  void Clear() { blocks_.clear(); }

 private:
  struct Block {
    int term;
    std::shared_ptr<const ceres::CostFunction> cost;
    std::shared_ptr<const ceres::LossFunction> loss;
    std::vector<MotionQuantity> quantities;
  };
  std::vector<std::string> terms_;
  std::vector<Block> blocks_;
};

}  // namespace holdfast
