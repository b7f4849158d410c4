// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/network.h"
#include "generator/imos/synthesis_network.h"
#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/fit_options.h"
#include "solver/fit/frame_fitter.h"

/// IMoS's loop with the object fit: from a person holding an object and an intent to key frames
/// with the fitted object, and motion through them.

namespace holdfast {

/// Person, object, action and start of a synthesis.
struct SynthesisScene {
  /// The motion so far, at any frame rate: body, object track, fingers of the holding hands,
  /// `holding_hand` of the last frame. Its end is the last of the k key frames that condition the
  /// networks; before a shorter clip the person stands still.
  Clip start;
  Eigen::Matrix3Xd rest_joints;             ///< (3 x 55) of the person
  std::span<const HandModel* const> hands;  ///< hands that hold or may take over
  const FitObject& object;
  imos::Intent intent;
  double seconds_per_key_frame = 0.2;
  int key_frames = imos::kNumKeyFrames;  ///< including the k given ones
  bool changes_hands = false;            ///< the other hand takes over where the hands meet
};

/// Result of one sample, in the world of the start.
struct Synthesized {
  Clip clip;                         ///< key frames with object track and holding_hand
  std::vector<FrameReport> reports;  ///< of the generated key frames only
  int switch_frame = -1;             ///< key frame in which the other hand takes over, or -1
};

/// Returns the k key frames before the end of `start`, at the networks' rate; before its first
/// frame the person stands still. Throws Error for a clip without object or frames, or if nobody
/// holds the object in its last frame.
Clip HistoryOf(const Clip& start, double seconds_per_key_frame);

/// IMoS's loop (Ghosh et al. 2023, sec. 3): the networks generate each key frame's body pose, the
/// object is fitted to its hands (FrameFitter, as in the fit), and the object pose enters the
/// history of the next key frame. Sample i draws from stream `first_stream` + i of `seed`; results
/// do not depend on `threads`, nor on the number of samples. If the networks do not generate the
/// root translation, it is constant.
///
/// In a handover the other hand takes over when the palms are closest (25 cm or less) and begin to
/// separate; it then keeps its pose, with mirrored fingers: the fit of all frames computes the
/// grasp later (GraspsByTransfer).
///
/// Throws as HistoryOf and RunSynthesis do.
std::vector<Synthesized> Synthesize(const imos::Network<float>& network,
                                    const Eigen::Ref<const Eigen::MatrixXf>& action_table,
                                    const SynthesisScene& scene, const FitOptions& fit,
                                    int num_samples, std::uint64_t seed, std::uint64_t first_stream,
                                    double sigma, int threads);

/// Converts key frames to motion along a smooth curve (ResampleSmoothly). If no key frame has a
/// foot 15 cm from its first position, feet stay fixed, and the person breathes and sways (AddSway
/// with `seed`), which key frames cannot represent; otherwise stance feet are pinned (LockFeet).
/// The object track follows the same curve: the fit of all frames recomputes it. The rest pose
/// stands on measures.sole_y, the ground is z = 0.
Clip MotionOfKeyFrames(const Clip& keys, const BodyMeasures& measures, double frame_rate,
                       std::uint64_t seed);

/// Returns the distance of the right hand from its first position in each frame, in the chest's
/// frame, meters.
std::vector<double> HandDistances(const std::vector<BodyPlacement>& placed);

/// Returns the pose of the wrist that holds the object in each frame: the right one if it holds.
std::vector<Eigen::Isometry3d> HoldingHands(const Eigen::Matrix3Xd& rest_joints,
                                            const std::vector<BodyFrame>& frames, const Clip& clip);

/// Moves the object with its holding hand from the wrist poses `hands` to those of `frames`.
void TakeAlong(const Eigen::Matrix3Xd& rest_joints, const std::vector<BodyFrame>& frames,
               const std::vector<Eigen::Isometry3d>& hands, Clip& clip);

}  // namespace holdfast
