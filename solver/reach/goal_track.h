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
#include "solver/reach/reach_person.h"

namespace holdfast {

/// Goals as they come, 30 a second, from a table: a line each, numbers apart by commas, columns x,
/// y, z (world, meters, z up) or time (seconds), x, y, z; a first line of names may put them in
/// another order. Of another rate (`rate_hz`, or by time), a frame has the goal that came last.
/// Throws Error naming file and line for what is no number, a time that does not increase, a goal
/// below the ground, and a table without goals or of more than an hour.
std::vector<Eigen::Vector3d> ReadGoalTrack(const std::filesystem::path& path,
                                           std::optional<double> rate_hz = {});

/// Something moves the body at a frame (GoalFollower::Push).
struct TrackPush {
  int frame = 0;  ///< of the goals, from 0
  Eigen::Vector3d by = Eigen::Vector3d::Zero();
};
/// "FRAME,DX,DY,DZ". Throws Error for what is not that.
TrackPush ParsePush(const std::string& text);

/// A person behind a goal, measured.
struct FollowReport {
  wandr::RolloutTrack track;           ///< frame 0 the start, frame t + 1 the answer to goal t
  std::vector<double> distance_m;      ///< of wrist and goal, for each goal
  double mean_m = 0.0, worst_m = 0.0;  ///< after the first second
  double skating = 0.0;                ///< FS: the lowest vertex moves more than 2/3 cm per frame
  double airborne = 0.0;               ///< share of frames with all foot joints above 12 cm
  double lowest_pelvis_m = 0.0;        ///< above the ground
  double lowest_foot_m = 0.0;          ///< of ankles and balls: in the ground where negative
  double acceleration_m_s2 = 0.0;      ///< mean of the 22 joints
  double seconds = 0.0;                ///< of one core, for all frames
  double slowest_frame_s = 0.0;
  bool stopped = false;  ///< by `progress`: all else is of the goals until then
};

/// GoalFollower through all goals. `progress` sees frames done and says whether to go on. Throws
/// Error as GoalFollower does, and for pushes at frames that are not there.
FollowReport FollowTrack(const ReachPerson& person, const wandr::NetworkWeights& network,
                         std::span<const Eigen::Vector3d> goals, std::span<const TrackPush> pushes,
                         const FollowOptions& options = {},
                         const std::function<bool(int done, int total)>& progress = {});

}  // namespace holdfast
