// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/rollout.h"
#include "geometry/clip/clip.h"

namespace holdfast::wandr {

inline constexpr int kNumReachStarts = 6;
inline constexpr int kReachStartFrame = 25;  ///< of a clip at 30 fps, as the published evaluation

/// A pose that motions of the protocol start from.
struct ReachStart {
  std::string name;  ///< of the clip, or what the pose is
  RolloutStart<double> start;
};

/// What the choice of clips goes by.
struct StartCandidate {
  std::string name;
  std::string subject;  ///< may be empty: then clips of an unknown person
  int num_frames = 0;   ///< at 30 fps
};

/// Indices of `count` clips with more than `frame` frames, from as many people as there are, evenly
/// spread: the same for the same candidates, whatever their order. Throws Error when there are
/// fewer.
std::vector<int> ChooseStartClips(std::span<const StartCandidate> candidates,
                                  int count = kNumReachStarts, int frame = kReachStartFrame);

/// Frame `frame` of every clip where it stands, with the step that led to it.
std::vector<ReachStart> StartsOfClips(std::span<const Clip> clips,
                                      std::span<const std::string> names,
                                      const Normaliser<double>& normaliser,
                                      int frame = kReachStartFrame);

/// Six poses that come from no capture: one stands at ease, the others are moments of reaches
/// composed by MakeReachMotion, with their velocity.
std::vector<ReachStart> ComposedStarts(const BodyMeasures& body,
                                       const Normaliser<double>& normaliser);

/// What the protocol takes.
std::vector<RolloutStart<float>> AsFloat(std::span<const ReachStart> starts);

}  // namespace holdfast::wandr
