// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/network.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/clip/clip.h"

namespace holdfast::wandr {

/// Returns the states (135 x F) of a clip's 22 body joints at 30 fps; other frame rates are
/// resampled. `trans` is used unchanged: it belongs to the clip's own body. Throws Error for a clip
/// without frames.
StateMatrix<double> StatesOfClip(const Clip& clip);

/// Returns joint positions (66 x F) of states.
Eigen::MatrixXf JointsOfStates(const Eigen::Ref<const StateMatrix<float>>& states,
                               const BoneOffsets<float>& bones);

/// Converts states to a clip at 30 fps: axis-angles unwrapped over time; fingers, jaw and eyes at
/// rest. StatesOfClip inverts this; ClipOfStates(StatesOfClip(clip)) reproduces the joints of a 30
/// fps clip up to rounding. Body (betas, gender, body_model), subject and similar fields are copied
/// from `like`.
Clip ClipOfStates(const Eigen::Ref<const StateMatrix<double>>& states, const Clip& like = {});

/// Returns the start of a rollout that continues a motion at `frame`: the pose and the delta that
/// led to it (rest at frame 0). Throws Error if there is no such frame.
RolloutStart<double> StartAtFrame(const Eigen::Ref<const StateMatrix<double>>& states, int frame,
                                  const Normalizer<double>& normalizer);

/// Start at rest: the delta has zero translation and identity rotations.
RolloutStart<double> StartAtRest(const Pose<double>& pose, const Normalizer<double>& normalizer);

/// A person standing upright with hanging arms, pelvis above the origin, facing -y, soles on the
/// ground z = 0. The default start of motions.
Pose<double> StandingPose(const BodyMeasures& body);

/// Rotates a pose about the vertical through the origin, then translates it. `rest_pelvis` is J_0,
/// the center of rotation of the SMPL-X root.
Pose<double> Moved(const Pose<double>& pose, double turn_rad, const Eigen::Vector3d& by,
                   const Eigen::Vector3d& rest_pelvis);

/// Mirrors a pose at x = 0 and swaps the sides, so that a network trained on right wrists also
/// serves left wrists. Exact for symmetric bones; `rest_pelvis` as in Moved.
Pose<double> Mirrored(const Pose<double>& pose, const Eigen::Vector3d& rest_pelvis);

}  // namespace holdfast::wandr
