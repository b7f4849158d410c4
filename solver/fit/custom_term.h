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

#include "geometry/rotation.h"

namespace holdfast {

/// Parameter blocks of the problem that is solved for a frame. Rotations are unit quaternions (x,
/// y, z, w) with RotationManifold.
enum class FitBlock {
  kObjectRotation,     ///< 4: object to world
  kObjectTranslation,  ///< 3: meters, world
  kRightFingers,       ///< 45: axis-angle, radians, in the body model's order
  kLeftFingers,        ///< 45
  /// Offset of a wrist from the clip's, where two hands hold: orientation W becomes W C, and the
  /// wrist moves by W c. Constant with one hand.
  kRightWristRotation,     ///< 4: C
  kRightWristTranslation,  ///< 3: c, meters, wrist's frame
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

/// The frame that is about to be solved.
struct CustomTermFrame {
  int frame = 0;                 ///< index; frame 0 is given and not solved
  double time_s = 0.0;           ///< of the clip
  ObjectPose start;              ///< of the object, where the solve begins
  const JointPose& pose;         ///< the clip's
  const Eigen::Vector3d& trans;  ///< the clip's, meters
};

/// A residual block of your own: Ceres minimizes it together with those of the fit, in each frame.
struct CustomTerm {
  std::string name;              ///< letters, digits and underscores; its column is energy_<name>
  double weight = 1.0;           ///< of its sum of squares; lambda_distance is 1
  std::vector<FitBlock> blocks;  ///< that it depends on, in its order
  /// Makes the cost function of a frame over `blocks`; null: no term in this frame. It is not
  /// called for frames in which a hand of `blocks` does not hold.
  std::function<std::unique_ptr<ceres::CostFunction>(const CustomTermFrame&)> make;
};

/// Throws Error for a name that cannot be a column or comes twice, a weight that is not positive
/// and finite, and a term without blocks or without `make`.
void CheckCustomTerms(std::span<const CustomTerm> terms);

/// A CustomTerm in one frame, times its weight. A fault (an exception, a number that is not finite,
/// a wrong size) becomes `false` for Ceres and a message for the user.
class GuardedTerm final : public ceres::CostFunction {
 public:
  /// `term` must outlive this.
  GuardedTerm(const CustomTerm& term, const CustomTermFrame& frame);

  /// Whether there is a term in this frame.
  bool Acts() const { return cost_ != nullptr; }
  /// The last fault; empty while there is none.
  const std::string& Fault() const { return fault_; }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  /// Sum of squares without weight; NaN where there is no term or it fails.
  double Energy(double const* const* parameters) const;

 private:
  const CustomTerm& term_;
  std::unique_ptr<ceres::CostFunction> cost_;
  mutable std::string fault_;
};

}  // namespace holdfast
