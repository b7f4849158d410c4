// SPDX-License-Identifier: MIT
#pragma once

/// The object optimizer. Input: a clip, its hands, an object and the holding hands per frame.
/// Output: a clip with object poses, fingers and arms solved for every frame, and energies.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/fit_options.h"
#include "solver/fit/frame_fitter.h"

namespace holdfast {

/// Hand configuration in one frame of a hold.
struct GraspPose {
  FingerPose fingers = FingerPose::Zero();
  /// Hand pose relative to the clip's wrist of that frame: the hand may have to move to the object.
  WristOffset offset;
};

/// Input for a grasp callback, which is called once for each start of a hold, including in the
/// first frame.
struct GraspRequest {
  int frame;
  Side side;
  const JointPose& pose;         ///< of that frame, with the other hand holding
  const Eigen::Vector3d& trans;  ///< of that frame
  const ObjectPose& object;      ///< of that frame
};
using GraspMaker = std::function<GraspPose(const GraspRequest&)>;

struct FitResult {
  Clip clip;  ///< input with fitted arms and fingers, object track and holding_hand
  std::vector<FrameReport> frames;
  int num_contact_pairs = 0;              ///< sum of S over all grasps
  std::vector<std::string> custom_terms;  ///< names of FitOptions::custom_terms
};

/// Solves object pose and finger angles for every frame of a clip, with one or two hands. The first
/// frame gives the object pose and the fingers of the hands that hold it there; object poses and
/// these hands' fingers in later frames are replaced. `holding` (T bitmasks as in
/// Clip::holding_hand) gives the holding hands; `grasps` returns the grasp of a hand that starts to
/// hold (if empty: the grasp of the first frame). Around holds, fingers (and arms that deviate from
/// the clip) are blended over FitOptions::release_s. Object rotations are unwrapped (no jumps of 2
/// pi).
///
/// `progress` (frames done, frames) may be empty; returning false stops the fit, and the result
/// then has the frames done. Throws Error for a clip without an object track, an object without
/// vertices, `holding` of another length or with a hand missing in `hands`, and a later grasp
/// without `grasps`.
FitResult FitClip(const Clip& clip, std::span<const HandModel* const> hands,
                  const FitObject& object, std::span<const std::uint8_t> holding,
                  const FitOptions& options, const GraspMaker& grasps = {},
                  const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
