// SPDX-License-Identifier: MIT
#include "geometry/io/motion_limits.h"

#include <fmt/format.h>

#include "geometry/io/motion_file.h"

namespace holdfast {

void RequireBearable(const TextScanner& scanner, double frames, int joints,
                     std::size_t text_bytes) {
  constexpr double kAlwaysBytes = 60 << 20;
  const double joint_frames = frames * joints;
  if (joint_frames > kMaxJointFrames) {
    scanner.Fail(fmt::format("{} frames of {} joints are more than fit", frames, joints),
                 "Cut the motion into parts");
  }
  if (joint_frames * kJointFrameBytes > 10 * static_cast<double>(text_bytes) + kAlwaysBytes) {
    scanner.Fail(fmt::format("{} frames of {} joints, most of which never move, would take more "
                             "memory than {} bytes of text may ask for",
                             frames, joints, text_bytes),
                 "Leave out the joints without channels, or cut the motion into parts");
  }
}

}  // namespace holdfast
