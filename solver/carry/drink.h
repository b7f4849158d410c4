// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>

#include <Eigen/Core>

#include "generator/actions/face_marks.h"
#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "solver/carry/first_grasp.h"
#include "solver/fit/prepared_object.h"
#include "solver/grasp/grasp.h"
#include "solver/markers/unmarked_head.h"

namespace holdfast {

/// When a hand takes something from a table to the mouth and back: frames.
struct DrinkTimes {
  Side side = Side::kRight;
  int lift = 0;      ///< it rests at the table for the last time before
  int drink = 0;     ///< the palm is nearest to the mouth
  int put_down = 0;  ///< and rests at the table for the first time after
};

/// Finds them from the motion of both hands: the one that comes nearer to the mouth. Nothing where
/// none comes within 25 cm of it, where it rises by less than 10 cm for that, and where it goes on
/// above the eyes or by the side of the head and down behind it.
std::optional<DrinkTimes> FindDrink(const PalmTracks& tracks, const FaceMarks& face);

/// Where something is drunk from in a pose: the lowest place of its rim, or, upright, that nearest
/// to `mouth`; world, meters.
Eigen::Vector3d DrinkingEdge(const ObjectMarks& cup, const Eigen::Isometry3d& world_from_cup,
                             const Eigen::Vector3d& mouth);

/// How well a clip drinks, at DrinkTimes.
struct DrinkMeasures {
  double rim_from_mouth_m = 0.0;  ///< DrinkingEdge from the mouth on the skin, at `drink`
  double tilt_rad = 0.0;          ///< of the cup, at `drink`
  double lean_rad = 0.0;          ///< of the cup off upright, the more of `lift` and `put_down`
};
DrinkMeasures MeasureDrink(const Clip& clip, const DrinkTimes& times,
                           const Eigen::Matrix3Xd& rest_joints, const FaceMarks& face,
                           const ObjectMarks& cup);

struct DrinkReport {
  DrinkTimes times;
  GraspStatus status = GraspStatus::kNoRoom;
  Grasp grasp;
  HeadReport head;
  double wrist_shift_m = 0.0, wrist_turn_rad = 0.0;  ///< most, from the clip's own
};

/// Puts a cup into the hand that drinks: upright on the table before `lift` and after `put_down`,
/// in between in the hand as it is lifted. The cup is placed so that it is upright in that hand,
/// its bottom where the resting hand shows the table, and fingers are closed around it where that
/// is firmest (CloseFingers, RefineGrasp); what is left of lean and height at either end the wrist
/// gives, over the way to the mouth. Neck and head, which are taken for unmarked, bring the mouth
/// to the rim, lean back with a cup that is tilted far, and keep clear of it (PoseUnmarkedHead).
/// The clip gets object, holding_hand and fingers; for CarryObject to fit. Throws Error where
/// nobody drinks, and for a cup without a rim.
DrinkReport ServeDrink(const ClipBody& body, const PreparedObject& cup, std::uint64_t seed,
                       Clip& clip);

}  // namespace holdfast
