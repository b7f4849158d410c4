// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/network.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/clip/clip.h"

namespace holdfast::wandr {

/// States (135 x F) of a clip's 22 body joints, at 30 fps (a clip of another rate is resampled).
/// `trans` is taken as it is: it belongs to the clip's own body. Throws Error for a clip without
/// frames.
StateMatrix<double> StatesOfClip(const Clip& clip);

/// Joint positions (66 x F) of states.
Eigen::MatrixXf JointsOfStates(const Eigen::Ref<const StateMatrix<float>>& states,
                               const BoneOffsets<float>& bones);

/// The clip of states: axis-angles without jumps between frames, fingers, jaw and eyes at rest,
/// 30 fps. StatesOfClip gives the states back, and ClipOfStates(StatesOfClip(clip)) the joints of a
/// 30 fps clip, to rounding. Body (betas, gender, body_model), subject and the like are those of
/// `like`.
Clip ClipOfStates(const Eigen::Ref<const StateMatrix<double>>& states, const Clip& like = {});

/// Where a rollout that continues a motion at `frame` starts: the pose, and the delta that led to
/// it (rest at frame 0). Throws Error when there is no such frame.
RolloutStart<double> StartAtFrame(const Eigen::Ref<const StateMatrix<double>>& states, int frame,
                                  const Normalizer<double>& normalizer);

/// A pose at rest: the delta is no translation and identity rotations.
RolloutStart<double> StartAtRest(const Pose<double>& pose, const Normalizer<double>& normalizer);

/// A person standing upright with hanging arms, pelvis above the origin, facing -y, soles on the
/// ground z = 0: where motions start when nothing else is given.
Pose<double> StandingPose(const BodyMeasures& body);

/// The pose turned about the vertical through the origin, then moved: the same motion elsewhere.
/// `rest_pelvis` is J_0, about which SMPL-X's root turns.
Pose<double> Moved(const Pose<double>& pose, double turn_rad, const Eigen::Vector3d& by,
                   const Eigen::Vector3d& rest_pelvis);

/// The pose seen in a mirror at x = 0, sides swapped: what the right wrist reaches here, the left
/// one reaches there. A network trained on right wrists serves left ones so. Exact for symmetric
/// bones; `rest_pelvis` as in Moved.
Pose<double> Mirrored(const Pose<double>& pose, const Eigen::Vector3d& rest_pelvis);

}  // namespace holdfast::wandr
