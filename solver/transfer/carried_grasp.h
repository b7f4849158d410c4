// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "solver/fit/prepared_object.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/hand/hand_axes.h"
#include "solver/hand/hand_evaluation.h"
#include "solver/terms/hand/penetration.h"
#include "solver/transfer/surface_map.h"

namespace holdfast {

/// A hand at an object: finger angles, and the object's pose in the wrist's frame.
struct HandOnObject {
  FingerPose fingers = FingerPose::Zero();
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();
};

/// A grasp transferred from one object to another, or from one hand to another.
struct CarriedGrasp {
  HandOnObject hold;
  bool clean = false;           ///< nowhere deeper than 1.8 mm, fingers touch as before
  bool searched = false;        ///< the transferred grasp was not clean; found by a search near it
  std::string refused;          ///< fault of the transferred grasp; empty if it was clean
  int contacts = 0;             ///< hand vertices in contact with the first object
  double contact_off_mm = 0.0;  ///< their mean distance from their mapped targets
  double hand_in_object_mm = 0.0, object_in_hand_mm = 0.0;
  int fingers_touching = 0, fingers_touched = 0;  ///< on the new object; on the first object
  /// Relative to the wrist pose given by the map's rotation and position alone.
  double wrist_shift_m = 0.0, wrist_turn_rad = 0.0;
};

/// Skin closer than this is in contact.
inline constexpr double kCarriedTouch_m = 0.005;

/// A hand of the clip's person and the same hand of the target person, with derived data; const,
/// shared by objects and threads. The arguments must outlive it.
class CarryingHand {
 public:
  /// Throws Error for hands of different sides or with different vertices.
  CarryingHand(const HandModel& from_hand, const HandModel& to_hand);

  const HandModel &from, &to;
  HandAnatomy anatomy;  ///< of `to`
  HandAxes axes_from;
  ClosedHands closed;  ///< of `to`
};

/// Transfers grasps of one hand from an object to another one. Precomputes all that is independent
/// of grasp and time; const and thread-safe. The arguments must outlive it.
class GraspCarrier {
 public:
  /// The first hand held `from_object`; the second one is to hold `to_object`. `search`: whether a
  /// new grasp is searched nearby if the transferred one is not clean; `seed` and `threads` of the
  /// search.
  GraspCarrier(const CarryingHand& hand, const PreparedObject& from_object,
               const PreparedObject& to_object, const SurfaceMap& map, bool search,
               std::uint64_t seed, int threads);

  /// Transfers a grasp such that skin near the object keeps its distance: a vertex with nearest
  /// point c, normal n and distance d has the target c' + d n', with (c', n') = SurfaceMap::At(c,
  /// n) (VertexGoals). Wrist and fingers are solved for these, then with penetration in both
  /// directions and joint limits; pads close to the surface are moved onto it (RefineGrasp). If the
  /// result is not clean, grasps are searched (CloseHand) and the best nearby one is used.
  ///
  /// `up_in_wrist`: the world's up in the wrist's frame, for a search. Throws Error for a hand that
  /// is nowhere near the object.
  CarriedGrasp Carry(const HandOnObject& held, const Eigen::Vector3d& up_in_wrist) const;

  /// Returns the maximum depth of the second object's surface in the second hand (`vertices`: 3 x
  /// N, in any frame; `frame_from_object` maps the object into it), meters.
  double ObjectInHand(const Eigen::Matrix3Xd& vertices,
                      const Eigen::Isometry3d& frame_from_object) const;

 private:
  struct Goals;
  Goals GoalsOf(const HandOnObject& held) const;
  void Minimize(const Goals& goals, double goal_weight, bool skin, int rounds,
                const HandAngles& preferred, HandOnObject& hold) const;
  void PressOn(HandOnObject& hold) const;
  std::vector<Intrusion> Intrusions(const Eigen::Matrix3Xd& vertices,
                                    const Eigen::Isometry3d& pose) const;
  CarriedGrasp Measured(const Goals& goals, const HandOnObject& hold) const;
  void Search(const Goals& goals, const Eigen::Vector3d& up_in_wrist, CarriedGrasp& carried) const;

  const CarryingHand& hand_;
  const PreparedObject &first_, &second_;
  const SurfaceMap& map_;
  bool search_;
  std::uint64_t seed_;
  int threads_;
  PointPatches patches_;  // of the second object's surface
};

}  // namespace holdfast
