// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/common.h"
#include "apps/reach_network.h"
#include "solver/reach/goal_track.h"

namespace holdfast::apps {

/// A goal that moves, as the command line asks for it.
struct TrackJob {
  std::string goals;  ///< table, or "-"
  std::optional<double> rate_hz;
  std::vector<std::string> pushes;  ///< "FRAME,DX,DY,DZ"
  FollowOptions follow;
  std::string output;
  bool write_report = true;
};

/// The person follows the goals of a table; writes clip.npz, metrics.json and report.html.
Outcome RunReachTrack(const TrackJob& job, const ReachPerson& person, const std::string& from,
                      const ReachNetwork& network, const CommonOptions& common);

}  // namespace holdfast::apps
