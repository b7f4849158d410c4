// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/body/body_model.h"

namespace holdfast {

/// Motion of a person who stands idle at the origin, facing -y, 30 fps.
struct StandingStart {
  std::string person;  ///< captured subject; empty for generated motion
  std::string source;  ///< name of the clip
  int source_frame = 0;
  std::vector<BodyFrame> frames;
};

/// Finds segments of captured motion (30 fps) in which a person stands: 0.8 s to 5 s long, trunk
/// and head upright, legs nearly straight, both feet on the ground and still, hands low and beside
/// or in front of the hips. Each segment is moved to the origin and rotated to face -y. The caller
/// sets `person` and `source`.
std::vector<StandingStart> FindStandingStarts(const Eigen::Matrix3Xd& rest_joints,
                                              std::span<const BodyFrame> frames);

/// Generates standing motion: MakeReachMotion with hanging arms, which breathes and sways.
StandingStart OwnStanding(const BodyMeasures& body, std::uint64_t seed);

/// Plays the start for `count` frames, back and forth as needed, slowest at the turning points. For
/// limb lengths other than those captured, the pelvis is raised or lowered until the lower ankle
/// has its height in the rest pose.
std::vector<BodyFrame> IdleMotion(const BodyMeasures& body, const StandingStart& start, int count);

/// Standing start motions, split into training and held-out subjects; no subject is in both.
struct ActionStarts {
  std::string name;                         ///< of the folder, or "own"
  std::vector<std::string> asked_held_out;  ///< requested held-out subjects
  std::vector<StandingStart> train = {}, held_out = {};
  std::vector<std::string> train_people = {}, held_out_people = {};
};

/// Finds starts in all clips (.npz) below a folder, on up to `threads` threads. The subject of a
/// clip is taken from a manifest.json of make-reach-data in the folder or above it; otherwise it is
/// the name of the clip's folder. `held_out` names the held-out subjects. Without names, these are
/// the subjects of clips in a folder called held_out, plus the two with the fewest starts among
/// those with at least ten (with fewer than three subjects: the later half of all starts).
///
/// For an empty `folder`, generates standing poses from `seed`, different ones for the held-out
/// set. Throws Error for a folder without clips or standing people, and for a name that does not
/// occur.
ActionStarts FindActionStarts(const std::string& folder, const std::vector<std::string>& held_out,
                              const BodyModel& body, std::uint64_t seed, int threads);

}  // namespace holdfast
