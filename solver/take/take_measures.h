// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/fit.h"
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

/// Returns the skin of all frames (3 x n, world) near a table at `bottom_middle` and less than 2 cm
/// above it.
Eigen::Matrix3Xd SkinNearTable(const Clip& clip, const BodySurface& surface,
                               const Eigen::Vector3d& bottom_middle, int threads);

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

}  // namespace holdfast
