// SPDX-License-Identifier: MIT
#pragma once

/// A person walks up to an object on a table, grasps it and carries it: from the object, its target
/// positions, a start and a generator of body motion to a clip with solved arm, fingers and object,
/// and its measures.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/parallel.h"
#include "geometry/score/contact_score.h"
#include "solver/fit/prepared_object.h"
#include "solver/take/take_measures.h"
#include "solver/take/take_motion.h"
#include "solver/take/take_plan.h"
#include "solver/take/take_table.h"

namespace holdfast {

/// The person who takes the object, and the start.
struct TakeStart {
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;
  Clip like;  ///< body, betas and subject of the generated clip
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();  ///< world, in the first frame
};

/// Generates body motions for a plan, one or several to choose from, best first; in the world, not
/// mirrored, for either side. The wrist's goals are `plan.goals`; `plan.table` should be avoided.
/// Called up to three times (`attempt` 0, 1, 2): again if no motion is suitable. Returns none to
/// stop.
using BodyMotionMaker =
    std::function<std::vector<TakeBodyMotion>(const TakePlan& plan, int attempt)>;

enum class TakeStatus {
  kTaken,
  kStopped,   ///< by `progress` or the motion maker
  kNoGrasp,   ///< see plan.status
  kNoMotion,  ///< see motion.fault
  kMissed,    ///< the hand stays centimeters from the grasp
};

struct TakeReport {
  TakeStatus status = TakeStatus::kStopped;
  TakePlan plan;
  TakeMotion motion;  ///< the selected motion, before the fit
  int attempt = 0;    ///< of the motion maker
  int index = 0;      ///< of the motion within its attempt
  SideTable table;
  Clip clip;             ///< with object, table, fitted fingers
  ContactScore contact;  ///< holding from the take on; approaching and closing before
  TakeMeasures measured;
  double wanders_mm = 0.0, wanders_deg = 0.0;  ///< maximum drift in the holding hand from the grasp
  std::vector<std::string> notes;              ///< imperfections
};

/// Takes an object from a table and carries it: plans the take (PlanTake), generates motions,
/// selects the best, solves arm and fingers while taking, holding and carrying, fits the object,
/// and measures. `request.pelvis` is overridden by the start's; threads and seed are the request's.
TakeReport TakeFromTable(const TakeRequest& request, const TakeStart& start,
                         const PreparedObject& object, const BodyMotionMaker& motion,
                         const StagedProgress& progress = {});

/// Maximum penetration between hand and object over frames [begin, end), mm.
double DeepestOver(const ContactScore& contact, int begin, int end);

}  // namespace holdfast
