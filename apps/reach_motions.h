// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/common.h"
#include "apps/reach_begin.h"
#include "apps/reach_job.h"
#include "apps/reach_network.h"
#include "generator/wandr/network.h"
#include "generator/wandr/reach_goals.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "solver/body_ik/reach_refit.h"

namespace holdfast::apps {

/// A solid to keep out of, in the world.
struct ReachObstacle {
  std::string name;
  TriangleMesh mesh;
  /// What optimised joints keep out of; its own mirror image where the left wrist reaches.
  std::shared_ptr<const DistanceGrid> distance;
};

/// Throws Error for a file that is no mesh, or a mesh without an inside.
ReachObstacle MakeObstacle(const std::string& name, TriangleMesh mesh, Side side, int threads);

/// What else one call may ask for.
struct ReachWishes {
  std::vector<int> stay_frames;  ///< for each goal; empty: as the method has it
  std::vector<ReachObstacle> obstacles;
  std::uint64_t seed_offset = 0;  ///< other motions than those of offset 0
};

/// Motions made, in the world whatever the side: states and joints of the body that moves.
struct ReachMotions {
  std::vector<wandr::ReachSample> samples;
  std::vector<RefitReport> refits;  ///< of those refitted: none, or all
  double seconds = 0.0;
  bool stopped = false;  ///< by Ctrl-C
};

/// Makes motions by the method the job names, with progress.
class ReachMaker {
 public:
  /// All must outlive it.
  ReachMaker(const ReachJob& job, const Beginning& begin, const ReachNetwork& network,
             const CommonOptions& common);

  ReachMotions Make(std::span<const Eigen::Vector3d> goals, const ReachWishes& wishes) const;

  /// RefitReach of a motion that Make made and did not refit; the wrist is placed at the goals that
  /// the motion reached. Outcomes are measured anew.
  RefitReport Refit(std::span<const Eigen::Vector3d> goals, wandr::ReachSample& sample) const;

 private:
  const ReachJob& job_;
  const Beginning& begin_;
  const CommonOptions& common_;
  Side side_;
  wandr::Network<float> network_;
  wandr::RolloutStart<float> start_;
};

}  // namespace holdfast::apps
