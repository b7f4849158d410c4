// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace holdfast::apps {

/// "640x480" as a pair of numbers from 1 to 16384; nothing for anything else.
std::optional<std::pair<int, int>> ParsePair(const std::string& text);

/// A file name with one %d or %0Nd in it, for numbered pictures.
struct NumberedName {
  std::string before, after;
  int digits = 1;

  std::string Name(int number) const;
};

/// Nothing for a name without '%'. Throws Error for one that is not such a pattern.
std::optional<NumberedName> ParseNumberedName(const std::string& name);

/// `count` frames of a clip evenly from the first to the last.
std::vector<int> EvenFrames(int num_frames, int count);

/// Every n-th frame of a clip.
std::vector<int> EveryFrame(int num_frames, int every);

/// The frames nearest to the times k / `frames_per_second`, so that played at that rate the clip
/// takes the time it took.
std::vector<int> FramesAtRate(int num_frames, double clip_frame_rate, double frames_per_second);

}  // namespace holdfast::apps
