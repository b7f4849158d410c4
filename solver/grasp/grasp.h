// SPDX-License-Identifier: MIT
#pragma once

/// Grasp synthesis. Input: a hand, an object with its signed distances, and where to grasp it.
/// Output: finger pose, object pose relative to the wrist, and measures of the grasp.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/options.h"
#include "geometry/score/contact_metrics.h"
#include "solver/grasp/grasp_certificate.h"
#include "solver/grasp/grasp_placement.h"
#include "solver/grasp/grasp_use.h"

namespace holdfast {

struct GraspOptions {
  int oppositions = 56;  ///< distinct antipodal pairs to try
  int turns = 12;        ///< approach directions per pair
  int closings = 240;    ///< most promising placements to close fingers on
  int refinements = 32;  ///< best closed hands to refine
  /// The only style allowed; none: the best of all, through its handle if it has one.
  std::optional<GraspStyle> style;
  /// How the object is grasped. None: as people grasp it, inferred from its shape. kAny: the
  /// firmest grasp.
  std::optional<GraspUse> use;
  double handle_weight = 1.0;  ///< preference for grasps through a handle
  std::uint64_t seed = 0;
  int threads = 1;  ///< the result does not depend on it

  /// World up (unit) in the wrist frame, one entry per admissible wrist pose: one for a given first
  /// frame, several where the forearm may still turn. Objects stand z-up; grasps that leave the
  /// object upright in one of these poses are preferred. Empty: orientation is ignored.
  std::vector<Eigen::Vector3d> up_in_wrist;
  /// Mean over the clip of world up in the wrist frame, for uses with ObjectUse::up_over_clip; its
  /// norm is below 1 where the wrist turns. None: up_in_wrist is used for all.
  std::optional<Eigen::Vector3d> mean_up_in_wrist;
  double upright_weight = 0.5;
  /// Objects are picked up from a table: maximum score penalty for hands that reach below the
  /// bottom (least z) of a tall object. 0: the object floats.
  double table_weight = 0.8;

  /// Obstacles for the object (the rest of the body, a table): points in the wrist frame, meters,
  /// one set (3 x n) per pose considered, such as frames of a clip.
  std::vector<Eigen::Matrix3Xd> obstacles_in_wrist;
  double obstacle_weight = 2.0;  ///< score penalty for a grasp blocked in every pose

  /// Where to grasp; null: anywhere. Hands that touch elsewhere are rejected.
  std::shared_ptr<const GraspPlace> place;

  double max_penetration_m = 0.0025;  ///< soft tissue compresses by 2 mm; deeper is rejected
  double touch_distance_m = 0.002;    ///< contact threshold for skin
  double friction = 0.5;

  /// Omit candidates that cannot be the best, and those without a handle if a handle grasp holds.
  bool best_only = false;
};

/// A hand grasping an object, relative to the wrist: independent of the body pose.
struct Grasp {
  GraspStyle style = GraspStyle::kPower;
  FingerPose fingers = FingerPose::Zero();
  /// x_wrist = R x_object + t; the wrist frame is the wrist joint's world rotation and position.
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();

  std::array<bool, kNumFingers> fingers_touching{};  ///< index, middle, pinky, ring, thumb
  std::array<bool, kNumFingers> fingers_through{};   ///< through a handle's opening, for kHandle
  bool palm_touching = false;
  /// Cosine between the directions in which the thumb's last phalanx and the opposed fingers press
  /// against each other; 0 if that phalanx does not touch.
  double thumb_opposition = 0.0;
  double max_penetration_mm = 0.0;   ///< skin in object, at vertices and edge midpoints
  double object_in_hand_mm = 0.0;    ///< object surface in the hand
  double self_penetration_mm = 0.0;  ///< fingers in each other or in the palm
  double limit_excess_deg = 0.0;
  double wrench_quality = 0.0;   ///< WrenchQuality; 0 without force closure
  double below_bottom_mm = 0.0;  ///< depth of the hand below the object's least z
  double outside_place = 0.0;    ///< fraction of the skin in contact that is outside the region
  double from_place_m = 0.0;     ///< from the center of the contacts to the requested point
  double in_keep_free = 0.0;     ///< fraction of the skin where ObjectUse wants none, or --avoid
  double blocked = 0.0;          ///< fraction of the poses with the object in an obstacle
  Eigen::Vector3d object_up = Eigen::Vector3d::UnitZ();  ///< the object's up (ObjectUse::up)
  double upright = 0.0;                                  ///< cosine with up; 0 if none is given
  double score = 0.0;                                    ///< larger is better
  ContactMetrics metrics;                                ///< of the returned grasp
  /// Of the returned grasp; none when the mesh encloses no solid (WhyNotSolid).
  std::optional<GraspCertificate> certificate;
};

enum class GraspStatus {
  kFound,
  kNothingToGrasp,  ///< no antipodal pair within a hand's span: too large, or no solid
  kNothingAtPlace,  ///< the same, at the requested place
  kNoHandle,        ///< handle requested, but no opening admits a finger
  kNoRoom,          ///< no collision-free placement of the hand
  kNoCleanGrasp,    ///< hands close, but not cleanly or not firmly; the best try is returned
  kFewer,           ///< FindGrasps found fewer grasps than requested
  kStopped,         ///< stopped by the progress callback; the returned hand is open
};
std::string_view Describe(GraspStatus status);
std::string_view StyleName(GraspStyle style);
/// "power", "precision" or "handle"; nothing for any other name.
std::optional<GraspStyle> StyleByName(std::string_view name);
/// Adds an option `name` whose values are a StyleName or "auto" (no value).
void AddStyleOption(OptionTable& table, const std::string& name, std::optional<GraspStyle>& style,
                    std::string help);

struct GraspReport {
  GraspStatus status = GraspStatus::kNothingToGrasp;
  GraspUse use = GraspUse::kAny;  ///< assumed use of the object
  int oppositions = 0, handles = 0, placements = 0, closings = 0, refinements = 0;
  /// All fully refined grasps, best first, each with the reason for its rejection (empty:
  /// accepted).
  struct Candidate {
    Grasp grasp;
    std::string refused;
  };
  std::vector<Candidate> candidates;
  double search_ms = 0.0, closing_ms = 0.0, refinement_ms = 0.0;
};

/// Called repeatedly with the fraction of the work done, in [0, 1], by one thread at a time.
/// Returning false stops the search.
using GraspProgress = std::function<bool(double)>;

/// Closes a hand around an object. Finds antipodal pairs on the surface and places hands there in
/// power and precision style; finds handles and places hands with fingers through them. The fingers
/// close until they touch, the result is refined by least squares, and the firmest clean grasp is
/// returned. When the report's status is not kFound, returns the least bad try, or the open hand if
/// there was none.
///
/// `object` is in its own frame, meters; the signed distances are of the same mesh.
Grasp CloseHand(const HandModel& hand, const TriangleMesh& object, const SignedDistance& surface,
                const DistanceGrid& distance, const GraspOptions& options,
                GraspReport* report = nullptr, const GraspProgress& progress = {});

/// Pose of the object in the world for this world rotation and position of the wrist.
Eigen::Isometry3d ObjectInWorld(const Grasp& grasp, const Eigen::Matrix3d& wrist_rotation,
                                const Eigen::Vector3d& wrist_position);

}  // namespace holdfast
