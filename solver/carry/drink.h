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

/// Frames in which a hand takes an object from a table to the mouth and back.
struct DrinkTimes {
  Side side = Side::kRight;
  int lift = 0;      ///< last rest at the table before it
  int drink = 0;     ///< the palm is nearest to the mouth
  int put_down = 0;  ///< first rest at the table after it
};

/// Detects drinking from the motion of both hands, for the hand that comes nearer to the mouth.
/// Nothing if it does not come within 25 cm of the mouth, if it rises by less than 10 cm, or if it
/// moves on above the eyes, or by the side of the head and down behind it.
std::optional<DrinkTimes> FindDrink(const PalmTracks& tracks, const FaceMarks& face);

/// The hand in which the person of a clip without an object drinks from this object (FindDrink).
/// Nothing if the clip has another action than "drink", begins or ends at the mouth, if the hand
/// rises by less than 30 cm or is beside the head, if the body has no face, and for objects that
/// are neither deep and open on top nor bottles.
std::optional<Side> DrinkingHand(const Clip& clip, const ClipBody& body,
                                 const PreparedObject& object);

/// Quality of drinking in a clip, at DrinkTimes.
struct DrinkMeasures {
  double rim_from_mouth_m = 0.0;  ///< lowest point of the rim to the mouth on the skin, at `drink`
  double tilt_rad = 0.0;          ///< of the cup, at `drink`
  double lean_rad = 0.0;          ///< of the cup from upright, maximum of `lift` and `put_down`
  double neck_rad = 0.0;          ///< of the way from neck to head from the vertical, maximum
};
DrinkMeasures MeasureDrink(const Clip& clip, const DrinkTimes& times,
                           const Eigen::Matrix3Xd& rest_joints, const FaceMarks& face,
                           const ObjectMarks& cup);

struct DrinkReport {
  DrinkTimes times;
  GraspStatus status = GraspStatus::kNoRoom;
  Grasp grasp;
  HeadReport head;
  double wrist_shift_m = 0.0, wrist_turn_rad = 0.0;  ///< maximum change from the clip
};

/// Puts a cup into the drinking hand: upright on the table before `lift` and after `put_down`, in
/// between in the hand as lifted. The cup is placed upright in that hand, with its bottom at the
/// table height inferred from the resting hand, and the fingers close around it where the grasp is
/// firmest (CloseFingers, RefineGrasp). The wrist corrects the remaining tilt and height at either
/// end over the motion to the mouth, and brings the rim to within 2 cm of the mouth. Neck and head,
/// assumed to be unmarked, move the mouth the rest of the way, lean back with a strongly tilted
/// cup, and stay clear of it (PoseUnmarkedHead). Sets object, table, holding_hand and fingers of
/// the clip; CarryObject then fits it. Throws Error if nobody drinks, and for a cup without a rim.
DrinkReport ServeDrink(const ClipBody& body, const PreparedObject& cup, std::uint64_t seed,
                       Clip& clip);

}  // namespace holdfast
