// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "solver/reach/goal_track.h"

namespace holdfast {

enum class TrackKind {
  kTurns,   ///< 1 m/s along the ground
  kJumps,   ///< 0.5 m/s, and 1 m at once every 5 s
  kPushes,  ///< 0.5 m/s, and the body is pushed by 0.3 m every 5 s
};
std::string_view TrackKindName(TrackKind kind);

/// A goal that moves for `frames` / 30 s, and what happens on the way.
struct DrawnTrack {
  std::vector<Eigen::Vector3d> goals;
  std::vector<TrackPush> pushes;
  std::vector<int> events;  ///< frames of jumps or pushes
};

/// Begins half a meter ahead of the person; every 2 s it is told to turn, at up to 90 degrees a
/// second, and to another height of 0.7 to 1.5 m, which it comes to at up to 0.4 m/s. The same seed
/// gives the same track.
DrawnTrack DrawTrack(TrackKind kind, const ReachPerson& person, std::uint64_t seed, int frames);

/// Means over the tracks of one kind.
struct TrackSummary {
  TrackKind kind = TrackKind::kTurns;
  int tracks = 0;
  double mean_m = 0.0;        ///< distance of wrist and goal after the first second
  double worst_mean_m = 0.0;  ///< of the worst track
  double skating = 0.0, airborne = 0.0, acceleration_m_s2 = 0.0;
  double lowest_pelvis_m = 0.0, lowest_foot_m = 0.0;  ///< of all
  int events = 0, recovered = 0;  ///< within 10 cm of the goal again after at most 4 s
  double ms_per_frame = 0.0, ms_slowest = 0.0;  ///< of one core
};

struct TrackStudyOptions {
  int tracks = 6;  ///< of each kind, over the starts in turn
  int frames = 600;
  FollowOptions follow;
  int threads = 1;
  std::function<void()> progress = {};  ///< for each track done; what it throws ends the study
};

/// Persons follow goals drawn by the seed of `options.follow`; the result does not depend on
/// `threads` but for times.
std::vector<TrackSummary> RunTrackStudy(std::span<const ReachPerson> persons,
                                        const wandr::NetworkWeights& network,
                                        const TrackStudyOptions& options = {});

}  // namespace holdfast
