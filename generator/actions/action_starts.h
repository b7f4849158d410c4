// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "generator/actions/standing_start.h"
#include "geometry/body/body_model.h"

namespace holdfast {

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
