// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "generator/imos/config.h"
#include "geometry/clip/clip.h"

namespace holdfast::imos {

/// Which moments of a clip are its key frames.
enum class KeyFrameRule {
  /// 15 moments evenly spread from the first frame to the last, between frames where need be.
  kWhole,
  /// As published: a, a + s, ..., a + 14 s, where a and b are the first and last frame with any
  /// contact with the object and s = floor((b - a) / 20): about 70 % of the contact.
  kPaper,
};

/// First and last frame in which anything touches the object: by the clip's contact labels where it
/// has them, else by `holding_hand`. Nothing when nothing does, or neither is there.
std::optional<std::pair<int, int>> ContactInterval(const Clip& clip);

/// Why the clip has no key frames by this rule: it is shorter than 15 frames; by the paper's rule,
/// nothing touches the object, or for less than 20 frames. Nothing where it has them.
std::optional<std::string> LackOfKeyFrames(const Clip& clip, KeyFrameRule rule);

/// The clip's 15 key frames as a clip of their own; its frame rate is theirs. Throws Error where
/// it has none.
Clip KeyFramesOf(const Clip& clip, KeyFrameRule rule);

}  // namespace holdfast::imos
