// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "solver/fit/prepared_object.h"
#include "solver/grasp/grasp_assessment.h"
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
  bool clean = false;           ///< within the limits of CarryGraspOptions
  bool searched = false;        ///< the transferred grasp was not clean; found by a search near it
  std::string refused;          ///< fault of the transferred grasp; empty if it was clean
  int contacts = 0;             ///< hand vertices in contact with the first object
  double contact_off_mm = 0.0;  ///< their mean distance from their mapped targets
  double hand_in_object_mm = 0.0, object_in_hand_mm = 0.0;
  int fingers_touching = 0, fingers_touched = 0;  ///< on the new object; on the first object
  /// Relative to the wrist pose given by the map's rotation and position alone.
  double wrist_shift_m = 0.0, wrist_turn_rad = 0.0;
};

struct CarryGraspOptions {
  double touch_m = 0.005;       ///< skin closer than this is in contact: S
  double fade_m = 0.008;        ///< weight of farther skin: exp(-(d / fade)^2)
  double max_depth_m = 0.0018;  ///< of hand and object in each other
  bool search = true;           ///< search a new grasp nearby if the transferred one is not clean
  std::uint64_t seed = 1;
  int threads = 1;  ///< of a search; does not affect the result
};

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
  /// The first hand held `from_object`; the second one is to hold `to_object`.
  GraspCarrier(const CarryingHand& hand, const PreparedObject& from_object,
               const PreparedObject& to_object, const SurfaceMap& map,
               const CarryGraspOptions& options = {});
  ~GraspCarrier();

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
  struct Scene;
  std::unique_ptr<const Scene> scene_;
};

}  // namespace holdfast
