// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "generator/wandr/rollout.h"
#include "solver/reach/goal_follower.h"
#include "solver/reach/reach_options.h"

namespace holdfast {

/// Reads goals at 30 per second from a table: one line per goal, comma-separated columns x, y, z
/// (world, meters, z up) or time (seconds), x, y, z; an optional header may give another order. At
/// other rates (`rate_hz`, or by time) a frame has the latest goal. Throws Error with file and line
/// for invalid numbers, times that do not increase, goals below the ground, and a table without
/// goals or longer than an hour.
std::vector<Eigen::Vector3d> ReadGoalTrack(const std::filesystem::path& path,
                                           std::optional<double> rate_hz = {});

/// A displacement of the body at a frame (GoalFollower::Push).
struct TrackPush {
  int frame = 0;  ///< index of the goal, from 0
  Eigen::Vector3d by = Eigen::Vector3d::Zero();
};
/// Parses "FRAME,DX,DY,DZ". Throws Error for other text.
TrackPush ParsePush(const std::string& text);

/// Motion that follows a goal, with its measures.
struct FollowReport {
  wandr::RolloutTrack track;           ///< frame 0 is the start, frame t + 1 the response to goal t
  std::vector<double> distance_m;      ///< wrist to goal, for each goal
  double mean_m = 0.0, worst_m = 0.0;  ///< after the first second
  double skating = 0.0;            ///< FS: fraction of frames, lowest vertex moves more than 2/3 cm
  double airborne = 0.0;           ///< fraction of frames with all foot joints above 12 cm
  double lowest_pelvis_m = 0.0;    ///< above the ground
  double lowest_foot_m = 0.0;      ///< of ankles and balls; negative: in the ground
  double acceleration_m_s2 = 0.0;  ///< mean of the 22 joints
  double seconds = 0.0;            ///< single-threaded, all frames
  double slowest_frame_s = 0.0;
  bool stopped = false;  ///< by `progress`: measures are of the goals until then
};

/// Runs GoalFollower through all goals. `progress` receives completed frames and returns whether to
/// continue. Throws Error as GoalFollower does, and for pushes at invalid frames.
FollowReport FollowTrack(const ReachPerson& person, const wandr::NetworkWeights& network,
                         std::span<const Eigen::Vector3d> goals, std::span<const TrackPush> pushes,
                         const FollowOptions& options = {},
                         const std::function<bool(int done, int total)>& progress = {});

}  // namespace holdfast
