// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "generator/matching/body_frame.h"
#include "generator/matching/leg_placement.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/body/body_model.h"

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

/// Standing people to start from, those of subjects that are learned from and those that are kept
/// away: nobody is in both.
struct ActionStarts {
  std::string name;                         ///< of the folder, or "own"
  std::vector<std::string> asked_held_out;  ///< who was to be held out
  std::vector<StandingStart> train = {}, held_out = {};
  std::vector<std::string> train_people = {}, held_out_people = {};
};

/// Finds starts in all clips (.npz) below a folder, on up to `threads` threads. Who a clip shows is
/// told by a manifest.json of make-reach-data in the folder or above it, else the clip's folder is
/// the person. Held out are the people of `held_out`, or without names those of clips in a folder
/// called held_out, and then the two with the fewest starts of all who have ten or more (of fewer
/// than three people: the later half of each one's starts).
///
/// An empty `folder`: standing poses of Holdfast's own by `seed`, other ones for those held out.
/// Throws Error for a folder without clips, without anybody who stands, and a name that nobody has.
ActionStarts FindActionStarts(const std::string& folder, const std::vector<std::string>& held_out,
                              const BodyModel& body, std::uint64_t seed, int threads);

}  // namespace holdfast
