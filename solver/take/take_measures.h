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

/// A take in numbers.
struct TakeMeasures {
  double object_in_table_mm = 0.0;  ///< deepest vertex of the object in the table, any frame
  int object_in_table_frame = -1;
  double hand_in_table_mm = 0.0;  ///< of the taking hand's skin
  int hand_in_table_frame = -1;
  double body_in_table_mm = 0.0;  ///< of all skin
  int body_in_table_frame = -1;
  double moved_before_take_mm = 0.0;  ///< greatest way of the object's origin before the take

  std::vector<double> tilt_deg;   ///< of the object's z from the vertical, per frame
  double max_tilt_deg = 0.0;      ///< while held
  std::vector<double> goal_m;     ///< of the bottom's middle from places[1 + k] at its frame
  double take_jump_mm = 0.0;      ///< way of the object's origin from the frame before the take
  double max_acceleration = 0.0;  ///< of the object's bottom middle, m/s^2
  int max_acceleration_frame = -1;
};

/// The skin of all frames (3 x n, world) that comes near a table at `bottom_middle`, lower than
/// 2 cm above it.
Eigen::Matrix3Xd SkinNearTable(const Clip& clip, const BodySurface& surface,
                               const Eigen::Vector3d& bottom_middle, int threads);

/// Measures a clip in which the object is taken at frame `take` and is at places[1 + k] at
/// `goals[k]`. Penetration of hand and object is ScoreContact's.
TakeMeasures MeasureTake(const Clip& clip, const BodySurface& surface, Side side,
                         const TakeObject& object, const SideTable& table, int take,
                         const std::vector<int>& goals, const std::vector<Eigen::Vector3d>& places,
                         int threads);

/// Fits the object to the hand (FitClip) from the take on; the frames before stay. Throws what
/// FitClip throws. `frames` may be null.
Clip FitTaken(const TakeMotion& motion, const HandModel& hand, const FitObject& object,
              const FitOptions& options, std::vector<FrameReport>* frames = nullptr,
              const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
