// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "solver/reach/goal_track.h"
#include "solver/reach/reach_and_take.h"

namespace holdfast::apps {

/// A take: a person walks to an object on a table, grasps it and carries it on.
struct TakeJob {
  std::string object;  ///< mesh or embedded object
  double object_scale = 1.0;
  Side side = Side::kRight;
  std::string style = "auto";  ///< grasp style: power, precision, handle, auto
  /// Centers of the object's bottom, world: the initial place (on a table of that height), then the
  /// target places.
  std::vector<Eigen::Vector3d> places;
  std::optional<double> object_yaw_deg;
  std::string output;
  bool write_report = true;
};

/// Runs the take (ReachAndTake) and writes the result folder: clip.npz, object.ply, table.ply,
/// metrics.json, report.html. `extra` is merged into metrics.json (the caller's options and
/// network). Throws Error and FitFailure.
Outcome RunReachTake(const TakeJob& job, const ReachPerson& person,
                     const wandr::NetworkWeights& network, const ReachOptions& options,
                     const nlohmann::json& extra, const CommonOptions& common);

/// A moving goal, as given on the command line.
struct TrackJob {
  std::string goals;  ///< table, or "-"
  std::optional<double> rate_hz;
  std::vector<std::string> pushes;  ///< "FRAME,DX,DY,DZ"
  FollowOptions follow;
  std::string output;
  bool write_report = true;
};

/// Follows the goals of a table; writes clip.npz, metrics.json and report.html.
Outcome RunReachTrack(const TrackJob& job, const ReachPerson& person, const std::string& from,
                      const ReachNetwork& network, const CommonOptions& common);

}  // namespace holdfast::apps
