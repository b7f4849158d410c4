// SPDX-License-Identifier: MIT
#pragma once

/// The object optimizer. A clip, its hands, an object and who holds it in each frame go in; a clip
/// with object poses, fingers and arms solved for every frame, with energies, comes out.

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

/// The grasp with which a hand takes hold.
struct GraspPose {
  FingerPose fingers = FingerPose::Zero();
  /// Where the hand is, relative to the clip's wrist of that frame: the hand may have to go to the
  /// object.
  WristOffset offset;
};

/// What a hand that is about to take hold can know: asked once for each time it does, in the first
/// frame too.
struct GraspRequest {
  int frame;
  Side side;
  const JointPose& pose;         ///< of that frame, with the other hand holding
  const Eigen::Vector3d& trans;  ///< of that frame
  const ObjectPose& object;      ///< of that frame
};
using GraspMaker = std::function<GraspPose(const GraspRequest&)>;

struct FitResult {
  Clip clip;  ///< the input with fitted arms and fingers, object track and holding_hand
  std::vector<FrameReport> frames;
  int num_contact_pairs = 0;              ///< sum of S of all grasps
  std::vector<std::string> custom_terms;  ///< names of FitOptions::custom_terms
};

/// Solves object pose and finger angles for every frame of a clip, with one hand or two. The first
/// frame has the object's pose and the fingers of the hands that hold it there; object poses and
/// these hands' fingers in later frames are replaced. `holding` (T bits as in Clip::holding_hand)
/// says who holds; how a hand takes hold is asked of `grasps` (without: as the first frame has it).
/// Hands come and go gently: fingers, and arms where they are off the clip's, are blended over
/// FitOptions::release_s. Object rotations come out unwrapped (no jumps of 2 pi).
///
/// `progress` (frames done, frames) may be empty and stops the fit by returning false (the result
/// then holds the frames done). Throws Error for a clip without an object track, an object without
/// vertices, `holding` of another length or naming a hand that `hands` lacks, and a later grasp
/// without `grasps`.
FitResult FitClip(const Clip& clip, std::span<const HandModel* const> hands,
                  const FitObject& object, std::span<const std::uint8_t> holding,
                  const FitOptions& options, const GraspMaker& grasps = {},
                  const std::function<bool(int, int)>& progress = {});

/// One hand through the whole clip, with the paper's terms alone: `object_vertices` (3 x M) is all
/// that they need.
FitResult FitClip(const Clip& clip, const HandModel& hand, const Eigen::Matrix3Xd& object_vertices,
                  const FitOptions& options = {},
                  const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
