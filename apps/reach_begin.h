// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/common.h"
#include "apps/reach_job.h"
#include "generator/scripted/reach_motion.h"
#include "generator/wandr/body_kinematics.h"
#include "generator/wandr/pose.h"
#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"

namespace holdfast::apps {

/// Where a reach starts, and on whose body.
struct Beginning {
  std::string source;
  int frame = 0;  ///< at 30 fps
  Clip like;      ///< body, betas and subject of the clip made
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;
  BodyMeasures measures;
  wandr::BoneOffsets<double> bones;
  wandr::StateMatrix<double> states;  ///< up to the frame

  /// World, in the first frame of the motion to be made.
  Eigen::Vector3d Pelvis() const;
};

/// Throws Error for a clip or frame that is not there, and for a hand alone.
Beginning BeginReach(const ReachJob& job, const CommonOptions& common);

/// Says what will be hard, and throws Error where there is no sense in trying: goals underground or
/// very far away.
std::vector<std::string> CheckGoals(std::span<const Eigen::Vector3d> goals, const Beginning& begin,
                                    const ReachJob& job, Side side);

/// Why a goal was missed, as far as it can be told: too high for this body, too little time, within
/// an obstacle, or no motion found. A sentence without a capital.
std::string WhyMissed(const Eigen::Vector3d& goal, const Eigen::Vector3d& from,
                      const Beginning& begin, const ReachJob& job, Side side, bool blocked);

/// "(1.50, 1.00, 1.10)"
std::string GoalText(const Eigen::Vector3d& goal);

}  // namespace holdfast::apps
