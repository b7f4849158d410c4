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

/// A hand at an object: fingers, and the object's frame in the wrist's.
struct HandOnObject {
  FingerPose fingers = FingerPose::Zero();
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();
};

/// A grasp carried from one object to another, or from one hand to another.
struct CarriedGrasp {
  HandOnObject hold;
  bool clean = false;           ///< within what CarryGraspOptions allow
  bool searched = false;        ///< the carried one was not, and this one was found anew near it
  std::string refused;          ///< what was wrong with the carried one; empty when it was clean
  int contacts = 0;             ///< vertices of the hand that touched the first object
  double contact_off_mm = 0.0;  ///< mean distance of these from where the map has them go
  double hand_in_object_mm = 0.0, object_in_hand_mm = 0.0;
  int fingers_touching = 0, fingers_touched = 0;  ///< now; on the first object
  /// From the wrist that the map's turn and place alone would have.
  double wrist_shift_m = 0.0, wrist_turn_rad = 0.0;
};

struct CarryGraspOptions {
  double touch_m = 0.005;       ///< skin nearer than this touches: S
  double fade_m = 0.008;        ///< farther skin counts by exp(-(d / fade)^2)
  double max_depth_m = 0.0018;  ///< of hand and object in each other
  bool search = true;           ///< a new grasp near the carried one where that is not clean
  std::uint64_t seed = 1;
  int threads = 1;  ///< of a search; the result does not depend on them
};

/// One hand of the clip's person and the same one of the person who is to hold, with what carrying
/// grasps takes of them; const, shared by objects and threads. What it is given must outlive it.
class CarryingHand {
 public:
  /// Throws Error for hands of two sides or with unlike vertices.
  CarryingHand(const HandModel& from_hand, const HandModel& to_hand);

  const HandModel &from, &to;
  HandAnatomy anatomy;  ///< of `to`
  HandAxes axes_from;
  ClosedHands closed;  ///< of `to`
};

/// Carries grasps of one hand from an object to another one. What depends on neither grasp nor
/// moment is worked out once; const and shared by threads. All that it is given must outlive it.
class GraspCarrier {
 public:
  /// The first hand held `from_object`, the second one is to hold `to_object`.
  GraspCarrier(const CarryingHand& hand, const PreparedObject& from_object,
               const PreparedObject& to_object, const SurfaceMap& map,
               const CarryGraspOptions& options = {});
  ~GraspCarrier();

  /// Skin near the first object keeps its distance to it: a vertex v with nearest point c and
  /// normal n there is wanted at c' + d n', with (c', n') = SurfaceMap::At(c, n) and d its distance
  /// (VertexGoals). Wrist and fingers are solved for that, then with penetration both ways and
  /// joint limits, and pads that are nearly there are brought onto the surface (RefineGrasp). Where
  /// that is not clean, grasps are searched for (CloseHand) and the best one near it is taken.
  ///
  /// `up_in_wrist`: the world's up in the wrist's frame, for a search. Throws Error for a hand that
  /// is nowhere near the object.
  CarriedGrasp Carry(const HandOnObject& held, const Eigen::Vector3d& up_in_wrist) const;

  /// How deep the second object's surface is in the second hand (3 x N, any frame that
  /// `frame_from_object` leads to), meters.
  double ObjectInHand(const Eigen::Matrix3Xd& vertices,
                      const Eigen::Isometry3d& frame_from_object) const;

 private:
  struct Scene;
  std::unique_ptr<const Scene> scene_;
};

}  // namespace holdfast
