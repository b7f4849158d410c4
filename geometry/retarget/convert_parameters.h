// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {

struct ConvertOptions {
  /// Coefficients of the target's shape that are solved for; 0 leaves its mean shape.
  int num_betas = 10;
  /// Meters that a coefficient of one may cost in the joints' places: keeps coefficients that the
  /// joints do not show at zero.
  double beta_ridge_m = 1e-5;
};

/// How far a joint of the target is from the source's, over all frames.
struct JointResidual {
  int joint = 0;  ///< of the 55
  double mean_mm = 0.0;
  double max_mm = 0.0;
};

struct ConvertedClip {
  Clip clip;
  std::vector<JointResidual> joints;  ///< of all that both models have
  double mean_mm = 0.0;               ///< over joints and frames
  double max_mm = 0.0;
  /// Of vertices, where both have the same triangles; empty otherwise.
  std::optional<double> vertex_mean_mm, vertex_max_mm;
  bool same_surface = false;      ///< both have the same triangles
  std::vector<std::string> lost;  ///< what the target has no place for, for people
};

/// A motion in the parameters of another body model. All poses are complete (flat_hand_mean =
/// true).
///
/// Rotations are relative to parents and hold for every model with SMPL-X's rest pose, so joints
/// that both models have keep theirs. The root turns about its rest place J_0, which differs
/// between models and shapes:
///     J_0 + trans = J_0' + trans'   =>   trans' = trans + J_0 - J_0'.
///
/// A whole body to a hand alone: the hand's root is the wrist as it is in the world,
///     R_root' = G_wrist,   trans' = G_wrist^t + trans - J_0',
/// and nothing of the rest of the body goes along. A hand alone to a hand alone of the same side
/// keeps everything. From a hand alone to a body there is no way without a body's motion:
/// PutHandOntoBody.
///
/// The target's betas are the least squares fit of its rest joints to the source's, from the first
/// joint both have (the pelvis or the wrist), and of its rest vertices where both models have the
/// same triangles. A subject's own surface goes along where it fits and is dropped otherwise.
///
/// `from` with `betas` is the source's body (WithTemplate for a subject). Throws Error for models
/// without a common joint set: hands of different sides, a hand alone to a body.
ConvertedClip ConvertClip(const Clip& clip, std::shared_ptr<const BodyModel> from,
                          const Eigen::VectorXd& betas, std::shared_ptr<const BodyModel> to,
                          const ConvertOptions& options = {});

/// Joints that both models have, ascending.
std::vector<int> CommonJoints(const BodyModel& a, const BodyModel& b);

/// How far the joints of one clip are from those of another with as many frames.
std::vector<JointResidual> CompareJoints(const Clip& a, const Eigen::Matrix3Xd& rest_joints_a,
                                         const Clip& b, const Eigen::Matrix3Xd& rest_joints_b,
                                         const std::vector<int>& joints);

}  // namespace holdfast
