// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "generator/matching/body_frame.h"
#include "generator/matching/leg_placement.h"
#include "generator/scripted/reach_motion.h"

namespace holdfast {

/// A person who stands and does nothing in particular: at the origin, facing -y, 30 fps.
struct StandingStart {
  std::string person;  ///< who was captured; empty for Holdfast's own
  std::string source;  ///< name of the clip
  int source_frame = 0;
  std::vector<BodyFrame> frames;
};

/// Stretches of captured motion (30 fps) in which somebody stands: at least 0.8 s, at most 5 s,
/// trunk and head upright, legs nearly straight, both feet on the ground and still, hands low and
/// beside or before the hips. Each is moved to the origin and turned to face -y. `person` and
/// `source` are left to the caller.
std::vector<StandingStart> FindStandingStarts(const Eigen::Matrix3Xd& rest_joints,
                                              std::span<const BodyFrame> frames);

/// Standing without a capture: MakeReachMotion's person with hanging arms, who breathes and sways.
StandingStart OwnStanding(const BodyMeasures& body, std::uint64_t seed);

/// The start for `count` frames, there and back again as often as that needs, slowest where it
/// turns round. Bodies of other limbs than the captured stand on the ground too: the pelvis is
/// raised or lowered until the lower ankle is where the rest pose has it.
std::vector<BodyFrame> IdleMotion(const BodyMeasures& body, const StandingStart& start, int count);

}  // namespace holdfast
