// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/goal_plan.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/rollout.h"
#include "geometry/clip/clip.h"

namespace holdfast::wandr {

/// How WANDR is evaluated (Diomataris et al. 2024, sec. 4): goals on a cylinder about each start
/// pose, several samples each; with 6 start poses, 5 x 5 x 5 x 5 x 6 = 3,750 motions of 8 s.
struct ReachProtocol {
  int num_angles = 5;     ///< equally spaced over the full turn; angle 0 is straight ahead
  int num_heights = 5;    ///< equally spaced over [0, max_height_m], meters above the floor z = 0
  int num_distances = 5;  ///< equally spaced over [min_distance_m, max_distance_m], horizontal
  int num_samples = 5;    ///< latents drawn for each goal
  double max_height_m = 1.8;
  double min_distance_m = 0.5;
  double max_distance_m = 5.0;
  int num_frames = 240;  ///< of each motion, its start included: 8 s

  /// When the goal is due: Fixed(240) is the paper's.
  DeadlineRule deadline = DeadlineRule::Fixed(240);
  IntentionOptions intention;
  bool with_intention = true;  ///< false: the network as a motion prior, blind to the goal
  double sigma = 1.0;          ///< of the latents
  std::uint64_t seed = 1;

  /// Goal due after a time that fits its distance, and kept in mind after that.
  static ReachProtocol Adaptive();
  /// Throws Error naming the field that makes no sense.
  void Check() const;
  int NumCases(int num_starts) const {
    return num_starts * num_angles * num_heights * num_distances * num_samples;
  }
};

/// One motion of the protocol. Case i always draws its latents from stream i of the seed.
struct ReachCase {
  int start = 0;
  int angle = 0;
  int height = 0;
  int distance = 0;
  int sample = 0;
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();  ///< world, meters
  int deadline = 0;                                ///< frames
};

/// Goals lie about the start's pelvis, angles counted from its heading, counter-clockwise from
/// above. By start, angle, height, distance, then sample. Throws Error as Check does, and for no
/// starts.
std::vector<ReachCase> ReachCases(const ReachProtocol& protocol, const BoneOffsets<float>& bones,
                                  std::span<const RolloutStart<float>> starts);

/// What else may be asked of a run.
struct ReachRun {
  int threads = 1;
  int first = 0;   ///< of the cases to run: any part of the protocol gives what the whole gives
  int count = -1;  ///< -1: all from `first`
  /// Motions done so far; one call at a time. What it throws ends the run.
  std::function<void(int done, int total)> progress = {};
  /// Changes a motion before it is measured and seen; called as `see` is.
  std::function<void(const ReachCase&, RolloutTrack&)> change = {};
  /// Sees every motion; called from several threads at a time, `index` counts from 0 over all
  /// cases.
  std::function<void(int index, const RolloutTrack&)> see = {};
};

/// Runs the protocol: outcomes in the order of ReachCases. They do not depend on `threads`.
std::vector<ReachOutcome> RunReachProtocol(const Network<float>& network,
                                           const BoneOffsets<float>& bones,
                                           std::span<const RolloutStart<float>> starts,
                                           const ReachProtocol& protocol, const ReachRun& run = {});

inline constexpr int kReachStartFrame = 25;  ///< of a clip at 30 fps, as the published evaluation

/// A pose that motions of the protocol start from.
struct ReachStart {
  std::string name;  ///< of the clip, or what the pose is
  RolloutStart<double> start;
};

/// Frame `frame` of every clip where it stands, with the step that led to it.
std::vector<ReachStart> StartsOfClips(std::span<const Clip> clips,
                                      std::span<const std::string> names,
                                      const Normalizer<double>& normalizer,
                                      int frame = kReachStartFrame);

/// Six poses that come from no capture: one stands at ease, the others are moments of reaches
/// composed by MakeReachMotion, with their velocity.
std::vector<ReachStart> ComposedStarts(const BodyMeasures& body,
                                       const Normalizer<double>& normalizer);

/// What the protocol takes.
std::vector<RolloutStart<float>> AsFloat(std::span<const ReachStart> starts);

}  // namespace holdfast::wandr
