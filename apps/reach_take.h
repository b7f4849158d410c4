// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "apps/fit_job.h"
#include "solver/take/take_plan.h"

namespace holdfast::apps {

/// A person walks to an object on a table, takes hold of it and carries it on.
struct TakeJob {
  std::string object;  ///< mesh or embedded object
  double object_scale = 1.0;
  Side side = Side::kRight;
  std::string style = "auto";  ///< of the grasp: power, precision, handle, auto
  /// Middles of the object's bottom, world: where it stands (on a table of that height), then where
  /// it shall be.
  std::vector<Eigen::Vector3d> places;
  std::optional<double> object_yaw_deg;
  std::string output;
  bool write_report = true;
};

/// Who does it, and where from.
struct TakeStart {
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;
  Clip like;                                         ///< body, betas and subject of the clip made
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();  ///< world, in the first frame
};

/// Makes the body's motion for a plan: one or several to choose from, best first. In the world, not
/// mirrored, whatever the side. The wrist's goals are `plan.goals`; `plan.table` is worth keeping
/// out of. Called up to three times: once, and again when no motion serves. `attempt` is 0, 1, 2.
/// Nothing (empty) after Ctrl-C.
using BodyMotionMaker = std::function<std::vector<TakenMotion>(const TakePlan& plan, int attempt)>;

/// Plans the take, has the motion made, chooses the one that serves best, makes arm and fingers
/// anew where they take, hold and carry, fits the object (FitClip), measures, and writes the result
/// folder: clip.npz, object.ply, table.ply, metrics.json, report.html. `extra` is merged into
/// metrics.json (the caller's options and network). Throws Error and FitFailure.
///
/// In RunReachJob:
///   TakeJob take{job.object, 1.0, side, job.style, goals, job.object_yaw_deg, job.output, ...};
///   return RunReachTake(take, {begin.body, begin.betas, begin.like, pelvis},
///                       [&](const TakePlan& plan, int attempt) { ... plan.goals[g].wrist ... },
///                       metrics, common);
FitOutcome RunReachTake(const TakeJob& job, const TakeStart& start, const BodyMotionMaker& motion,
                        const nlohmann::json& extra, const CommonOptions& common);

}  // namespace holdfast::apps
