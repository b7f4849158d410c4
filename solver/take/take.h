// SPDX-License-Identifier: MIT
#pragma once

/// A person walks up to an object on a table, grasps it and carries it. The object, its places, a
/// start and a generator of body motion go in; a clip with arm, fingers and object solved, and its
/// measures, come out.

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

/// Who takes an object, and where from.
struct TakeStart {
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;
  Clip like;                                         ///< body, betas and subject of the clip made
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();  ///< world, in the first frame
};

/// Makes the body's motion for a plan: one or several to choose from, best first. In the world, not
/// mirrored, whatever the side. The wrist's goals are `plan.goals`; `plan.table` is worth keeping
/// out of. Called up to three times: once, and again when no motion serves. `attempt` is 0, 1, 2.
/// Nothing (empty) when the work is to stop.
using BodyMotionMaker =
    std::function<std::vector<TakeBodyMotion>(const TakePlan& plan, int attempt)>;

enum class TakeStatus {
  kTaken,
  kStopped,   ///< by `progress` or the motion's maker
  kNoGrasp,   ///< plan.status says why
  kNoMotion,  ///< motion.fault says why
  kMissed,    ///< the hand stays centimeters from the grasp
};

struct TakeReport {
  TakeStatus status = TakeStatus::kStopped;
  TakePlan plan;
  TakeMotion motion;  ///< the one that was chosen, before the fit
  int attempt = 0;    ///< of the maker
  int index = 0;      ///< of the motion among those of its attempt
  SideTable table;
  Clip clip;             ///< with object, table, fitted fingers
  ContactScore contact;  ///< the hand holds from the take on; before, it comes and closes
  TakeMeasures measured;
  double wanders_mm = 0.0, wanders_deg = 0.0;  ///< object in the held hand, from its grasp, at most
  std::vector<std::string> notes;              ///< what is not quite right
};

/// A person takes an object from a table and carries it: plans the take (PlanTake), has the motion
/// made, chooses the one that serves best, makes arm and fingers anew where they take, hold and
/// carry, fits the object, and measures. `request.pelvis` is the start's, threads and seed are the
/// request's.
TakeReport TakeFromTable(const TakeRequest& request, const TakeStart& start,
                         const PreparedObject& object, const BodyMotionMaker& motion,
                         const StagedProgress& progress = {});

/// Deepest of hand and object in each other over frames [begin, end), mm.
double DeepestOver(const ContactScore& contact, int begin, int end);

}  // namespace holdfast
