// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"

namespace holdfast {

/// Parameter blocks of the problem solved for a frame. Rotations are unit quaternions (x, y, z, w)
/// with RotationManifold.
enum class FitBlock {
  kObjectRotation,     ///< 4: object to world
  kObjectTranslation,  ///< 3: meters, world
  kRightFingers,       ///< 45: axis-angle, radians, in body model order
  kLeftFingers,        ///< 45
  /// Offset of a wrist from the clip's where two hands hold: orientation W becomes W C, and the
  /// wrist moves by W c. Constant with one hand.
  kRightWristRotation,     ///< 4: C
  kRightWristTranslation,  ///< 3: c, meters, wrist frame
  kLeftWristRotation,      ///< 4
  kLeftWristTranslation,   ///< 3
};

struct FitBlockInfo {
  FitBlock block;
  const char* name;  ///< "object_rotation"
  int size;
};
/// All blocks, in the order of FitBlock.
std::span<const FitBlockInfo> FitBlocks();

/// The frame about to be solved.
struct CustomTermFrame {
  int frame = 0;                 ///< frame 0 is given and not solved
  double time_s = 0.0;           ///< in the clip
  ObjectPose start;              ///< initial object pose
  const JointPose& pose;         ///< of the clip
  const Eigen::Vector3d& trans;  ///< of the clip, meters
};

/// A user-defined residual block that Ceres minimizes with those of the fit, in each frame.
struct CustomTerm {
  std::string name;              ///< letters, digits and underscores; its column is energy_<name>
  double weight = 1.0;           ///< of its sum of squares; lambda_distance is 1
  std::vector<FitBlock> blocks;  ///< parameter blocks, in the term's order
  /// Returns the cost function of a frame over `blocks`; null: no term in this frame. Not called
  /// for frames in which a hand of `blocks` does not hold.
  std::function<std::unique_ptr<ceres::CostFunction>(const CustomTermFrame&)> make;
};

/// Throws Error for an invalid or repeated name, a weight that is not positive and finite, and a
/// term without blocks or without `make`.
void CheckCustomTerms(std::span<const CustomTerm> terms);

/// A CustomTerm in one frame, times its weight. An error (an exception, a non-finite value, a wrong
/// size) becomes `false` for Ceres and a message for the user.
class GuardedTerm final : public ceres::CostFunction {
 public:
  /// `term` must outlive this.
  GuardedTerm(const CustomTerm& term, const CustomTermFrame& frame);

  /// Whether the term is active in this frame.
  bool Acts() const { return cost_ != nullptr; }
  /// Message of the last error; empty if there was none.
  const std::string& Fault() const { return fault_; }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  /// Sum of squares without weight; NaN if there is no term or it fails.
  double Energy(double const* const* parameters) const;

 private:
  const CustomTerm& term_;
  std::unique_ptr<ceres::CostFunction> cost_;
  mutable std::string fault_;
};

}  // namespace holdfast
