// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/network.h"
#include "generator/imos/run_synthesis.h"
#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/fit_options.h"
#include "solver/fit/frame_fitter.h"

/// IMoS's loop with the fit in it. A person who holds an object and an intent go in; key frames
/// with the object fitted, and motion through them, come out.

namespace holdfast {

/// Who does what with which object, and where it begins.
struct SynthesisScene {
  /// The motion until now, at any frame rate: body, object track, fingers of the hands that hold,
  /// `holding_hand` of the last frame. Its end is the last of the k key frames that the networks go
  /// on from; a shorter clip than these take stands still before.
  Clip start;
  Eigen::Matrix3Xd rest_joints;             ///< (3 x 55) of the person
  std::span<const HandModel* const> hands;  ///< those that hold or may take over
  const FitObject& object;
  imos::Intent intent;
  double seconds_per_key_frame = 0.2;
  int key_frames = imos::kNumKeyFrames;  ///< with the k given ones
  bool changes_hands = false;            ///< the other hand takes over where the hands meet
};

/// What came of one sample, in the world of the start.
struct Synthesized {
  Clip clip;                         ///< key frames with object track and holding_hand
  std::vector<FrameReport> reports;  ///< of the key frames made, the given ones left out
  int switch_frame = -1;             ///< key frame in which the other hand takes over, or -1
};

/// The k key frames before the end of `start` (Clip of k frames): at the networks' rate, standing
/// still where it does not go back so far. Throws Error for a clip without an object, without
/// frames, or whose last frame nobody holds.
Clip HistoryOf(const Clip& start, double seconds_per_key_frame);

/// IMoS's loop (Ghosh et al. 2023, sec. 3): each key frame's body pose is made by the networks, the
/// object is fitted to its hands (FrameFitter, the fit's own code), and its pose goes into the
/// history of the next one. Sample i draws from stream `first_stream` + i of `seed`; the result
/// does not depend on `threads`, nor, sample by sample, on how many there are. Where the networks
/// do not make the root's translation, it stays where it is.
///
/// A hand that takes over does so when the palms have come as near to each other as they come (25
/// cm or less) and begin to part; it holds as it is there, with the other hand's fingers mirrored:
/// the grasp is computed (GraspsByTransfer) by the fit of all frames that follows.
///
/// Throws what HistoryOf and RunSynthesis throw.
std::vector<Synthesized> Synthesize(const imos::Network<float>& network,
                                    const Eigen::Ref<const Eigen::MatrixXf>& action_table,
                                    const SynthesisScene& scene, const FitOptions& fit,
                                    int num_samples, std::uint64_t seed, std::uint64_t first_stream,
                                    double sigma, int threads);

/// Key frames of a synthesis as motion: a curve through them (ResampleSmoothly). Feet stay
/// where the first frame has them when no key frame has one 15 cm away; of somebody who steps,
/// those that stand stay where they are (LockFeet); who stands breathes and sways (AddSway of
/// `seed`) as no key frame can. The object's track is the key frames' along the same curve: the fit
/// of all frames makes it anew. The person's rest pose stands on measures.sole_y, the ground is z =
/// 0.
Clip MotionOfKeyFrames(const Clip& keys, const BodyMeasures& measures, double frame_rate,
                       std::uint64_t seed);

/// Puts bodies back into the clip that they are of (BodyFrames): joints 0..21 and trans, rotations
/// unwrapped towards those that the clip had.
void SetBodyFrames(const std::vector<BodyFrame>& frames, const Eigen::Matrix3Xd& rest_joints,
                   Clip& clip);

/// Where, in each frame of the clip, the wrist is that holds the object: the right one where it
/// does.
std::vector<Eigen::Isometry3d> HoldingHands(const Eigen::Matrix3Xd& rest_joints,
                                            const std::vector<BodyFrame>& frames, const Clip& clip);

/// The object goes along with the hand that holds it, which was at `hands` and is where `frames`
/// have it.
void TakeAlong(const Eigen::Matrix3Xd& rest_joints, const std::vector<BodyFrame>& frames,
               const std::vector<Eigen::Isometry3d>& hands, Clip& clip);

}  // namespace holdfast
