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

/// Usual number of the target's shape coefficients to solve for.
inline constexpr int kConvertedBetas = 10;

/// Distance of a joint of the target from the source's, over all frames.
struct JointResidual {
  int joint = 0;  ///< of the 55
  double mean_mm = 0.0;
  double max_mm = 0.0;
};

struct ConvertedClip {
  Clip clip;
  std::vector<JointResidual> joints;  ///< all joints that both models have
  double mean_mm = 0.0;               ///< over joints and frames
  double max_mm = 0.0;
  /// Vertex distances, if both have the same triangles; empty otherwise.
  std::optional<double> vertex_mean_mm, vertex_max_mm;
  std::vector<std::string> lost;  ///< what the target cannot represent, as text
};

/// Converts a motion to the parameters of another body model. All poses are complete
/// (flat_hand_mean = true).
///
/// Rotations are relative to parents and valid for every model with SMPL-X's rest pose, so joints
/// that both models have keep theirs. The root rotates about its rest position J_0, which differs
/// between models and shapes:
///     J_0 + trans = J_0' + trans'   =>   trans' = trans + J_0 - J_0'.
///
/// For a whole body to a hand-only model, the hand's root is the wrist in the world,
///     R_root' = G_wrist,   trans' = G_wrist^t + trans - J_0',
/// and the rest of the body is dropped. A hand to a hand of the same side keeps everything. A hand
/// cannot be converted to a body without a body motion: see PutHandOntoBody.
///
/// The target's betas are the least squares fit of its rest joints to the source's, relative to the
/// first common joint (the pelvis or the wrist), and of its rest vertices if both models have the
/// same triangles. A subject's own surface is kept if it fits and dropped otherwise.
///
/// `from` with `betas` is the source's body (WithTemplate for a subject). `num_betas` shape
/// coefficients of the target are solved for; 0 keeps its mean shape. Throws Error for models
/// without a common joint set: hands of different sides, or a hand to a body.
ConvertedClip ConvertClip(const Clip& clip, std::shared_ptr<const BodyModel> from,
                          const Eigen::VectorXd& betas, std::shared_ptr<const BodyModel> to,
                          int num_betas = kConvertedBetas);

/// Joints that both models have, ascending.
std::vector<int> CommonJoints(const BodyModel& a, const BodyModel& b);

/// Distances of the joints of one clip from those of another with the same number of frames.
std::vector<JointResidual> CompareJoints(const Clip& a, const Eigen::Matrix3Xd& rest_joints_a,
                                         const Clip& b, const Eigen::Matrix3Xd& rest_joints_b,
                                         const std::vector<int>& joints);

}  // namespace holdfast
