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
#include "solver/fit/fit.h"
#include "solver/fit/prepared_object.h"
#include "solver/take/take_motion.h"
#include "solver/take/take_plan.h"
#include "solver/take/take_table.h"

namespace holdfast {

/// Measures of a take.
struct TakeMeasures {
  double object_in_table_mm = 0.0;  ///< maximum depth of object vertices in the table, all frames
  int object_in_table_frame = -1;
  double hand_in_table_mm = 0.0;  ///< of the taking hand's skin
  int hand_in_table_frame = -1;
  double body_in_table_mm = 0.0;  ///< of all skin
  int body_in_table_frame = -1;
  double moved_before_take_mm = 0.0;  ///< maximum displacement of its origin before the take

  std::vector<double> tilt_deg;   ///< of the object's z from vertical, per frame
  double max_tilt_deg = 0.0;      ///< while held
  std::vector<double> goal_m;     ///< distance of the bottom center from places[1 + k] at its frame
  double take_jump_mm = 0.0;      ///< displacement of the object's origin in the frame of the take
  double max_acceleration = 0.0;  ///< of the object's bottom center, m/s^2
  int max_acceleration_frame = -1;
};

/// Measures a clip in which the object is taken at frame `take` and is at places[1 + k] at
/// `goals[k]`. Penetration between hand and object is left to ScoreContact.
TakeMeasures MeasureTake(const Clip& clip, const BodySurface& surface, Side side,
                         const TakeObject& object, const SideTable& table, int take,
                         const std::vector<int>& goals, const std::vector<Eigen::Vector3d>& places,
                         int threads);

/// Fits the object to the hand (FitClip) from the take on; earlier frames are unchanged. Throws as
/// FitClip does. `frames` may be null.
Clip FitTaken(const TakeMotion& motion, const HandModel& hand, const FitObject& object,
              const FitOptions& options, std::vector<FrameReport>* frames = nullptr,
              const std::function<bool(int, int)>& progress = {});

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
