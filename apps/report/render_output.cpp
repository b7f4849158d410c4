// SPDX-License-Identifier: MIT
#include "apps/report/render_output.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::apps {
namespace {

constexpr int kMaxSide = 16384;  // pixels, or tiles

}  // namespace

std::optional<std::pair<int, int>> ParsePair(const std::string& text) {
  int a = 0;
  int b = 0;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, a);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != 'x') return std::nullopt;
  const auto second = std::from_chars(first.ptr + 1, end, b);
  if (second.ec != std::errc() || second.ptr != end || a < 1 || b < 1) return std::nullopt;
  if (a > kMaxSide || b > kMaxSide) return std::nullopt;
  return std::pair(a, b);
}

std::string NumberedName::Name(int number) const {
  return fmt::format("{}{:0{}}{}", before, number, digits, after);
}

std::optional<NumberedName> ParseNumberedName(const std::string& name) {
  const auto percent = name.find('%');
  if (percent == std::string::npos) return std::nullopt;
  const auto letter = name.find('d', percent);
  NumberedName pattern;
  if (letter != std::string::npos) {
    const std::string width = name.substr(percent + 1, letter - percent - 1);
    const auto [end, fault] =
        std::from_chars(width.data(), width.data() + width.size(), pattern.digits);
    pattern.before = name.substr(0, percent);
    pattern.after = name.substr(letter + 1);
    const bool number = fault == std::errc() && end == width.data() + width.size();
    if ((width.empty() || number) && pattern.digits >= 0 && pattern.digits <= 9 &&
        pattern.after.find('%') == std::string::npos) {
      return pattern;
    }
  }
  throw Error(name, "is not a pattern for numbered pictures", "Write it like frame_%03d.png");
}

std::vector<int> EvenFrames(int num_frames, int count) {
  std::vector<int> frames;
  count = std::min(count, num_frames);
  for (int k = 0; k < count; ++k) {
    frames.push_back(count == 1 ? 0 : k * (num_frames - 1) / (count - 1));
  }
  return frames;
}

std::vector<int> EveryFrame(int num_frames, int every) {
  std::vector<int> frames;
  for (int t = 0; t < num_frames; t += every) frames.push_back(t);
  return frames;
}

std::vector<int> FramesAtRate(int num_frames, double clip_frame_rate, double frames_per_second) {
  std::vector<int> frames;
  for (int k = 0;; ++k) {
    const double frame = std::round(k * clip_frame_rate / frames_per_second);
    if (frame > num_frames - 1) return frames;
    frames.push_back(static_cast<int>(frame));
  }
}

}  // namespace holdfast::apps
