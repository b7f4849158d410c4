// SPDX-License-Identifier: MIT
#include "geometry/io/motion/motion_file.h"

#include <string>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/value_ranges.h"

namespace holdfast {

void CheckMemoryBudget(const TextScanner& scanner, double frames, int joints,
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

void RequireInRange(const SourceMotion& motion, std::string_view where) {
  RequireFrameRate(motion.frame_rate, where);
  const std::string remedy =
      fmt::format("{} (import --meters-per-unit says another)", kMetersRemedy);
  const auto require = [&](const auto& positions, std::string_view field, std::string_view column) {
    RequireWithin(positions, kMaxMeters, where, field, column, remedy);
  };
  require(motion.rest_offsets, "offsets", "joint");
  for (std::size_t t = 0; t < motion.positions.size(); ++t) {
    require(motion.positions[t], fmt::format("frame {}", t), "joint");
  }
  for (std::size_t i = 0; i < motion.rotations.size(); ++i) {
    if (motion.rotations[i].coeffs().allFinite()) continue;
    throw Error(
        where, fmt::format("a rotation of frame {} is not a number", i / motion.joint_names.size()),
        "Cut such frames out, or export it again");
  }
  if (!motion.prop) return;
  require(motion.prop->positions, motion.prop->name, "frame");
  RequireInRange(motion.prop->mesh, where);
}

}  // namespace holdfast
