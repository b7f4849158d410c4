// SPDX-License-Identifier: MIT
#pragma once

/// New grasps. A hand, an object with its distances and where to take hold go in; finger pose, the
/// object's pose relative to the wrist, and measures of the grasp come out.

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
#include "solver/grasp/grasp_place.h"
#include "solver/grasp/grasp_placement.h"
#include "solver/grasp/grasp_use.h"

namespace holdfast {

struct GraspOptions {
  int oppositions = 56;  ///< different places on the object to take hold of
  int turns = 12;        ///< directions each is approached from
  int closings = 240;    ///< placements that fingers are closed for, the most promising
  int refinements = 32;  ///< closed hands that are refined, the best
  /// The only style that will do; none: the best of all, by its handle what has one.
  std::optional<GraspStyle> style;
  /// How the object is to be taken; none: as people take it, judged by its shape. kAny: as is
  /// firmest.
  std::optional<GraspUse> use;
  double handle_weight = 1.0;  ///< how much grasps through a handle are preferred
  std::uint64_t seed = 0;
  int threads = 1;  ///< the result is the same for any number

  /// World's up, unit, in the wrist's frame, for every pose the wrist may take (one for a first
  /// frame that is given, several where the forearm may still turn): objects stand z-up, and grasps
  /// that leave them upright in one of these are preferred. None: any way up is as good.
  std::vector<Eigen::Vector3d> up_in_wrist;
  double upright_weight = 0.5;
  /// Objects are picked up from a table: hands that reach below the bottom of one that stands high
  /// (its least z) are less welcome by up to this much of score. 0: the object floats.
  double table_weight = 0.8;

  /// What the object must keep out of (the rest of the body, a table): points in the wrist's frame,
  /// meters, one set (3 x n) for each pose that counts, such as frames of a clip.
  std::vector<Eigen::Matrix3Xd> obstacles_in_wrist;
  double obstacle_weight = 2.0;  ///< taken from the score of a grasp that meets them in every pose

  /// Where to take hold; none: anywhere. Hands that touch elsewhere are refused.
  std::shared_ptr<const GraspPlace> place;

  double max_penetration_m = 0.0025;  ///< soft tissue gives 2 mm; deeper is refused
  double touch_distance_m = 0.002;    ///< skin nearer than this touches
  double friction = 0.5;

  /// Candidates that cannot be the best, or are not by a handle where one holds, are left out.
  bool best_only = false;
};

/// A hand holding an object, relative to the wrist: fits any body pose.
struct Grasp {
  GraspStyle style = GraspStyle::kPower;
  FingerPose fingers = FingerPose::Zero();
  /// x_wrist = R x_object + t; the wrist frame is the wrist joint's world rotation and position.
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();

  std::array<bool, kNumFingers> fingers_touching{};  ///< index, middle, pinky, ring, thumb
  std::array<bool, kNumFingers> fingers_through{};   ///< a handle's opening, for kHandle
  bool palm_touching = false;
  double max_penetration_mm = 0.0;   ///< skin in object, vertices and middles of edges
  double object_in_hand_mm = 0.0;    ///< object's surface in the hand
  double self_penetration_mm = 0.0;  ///< fingers in each other or the palm
  double limit_excess_deg = 0.0;
  double wrench_quality = 0.0;   ///< WrenchQuality: 0 without force closure
  double below_bottom_mm = 0.0;  ///< how far the hand reaches below the object's least z
  double outside_place = 0.0;    ///< share of the skin in contact that is out of its region
  double from_place_m = 0.0;     ///< of the middle of the contacts from the point asked for
  double blocked = 0.0;          ///< share of the poses in which the object meets an obstacle
  Eigen::Vector3d object_up = Eigen::Vector3d::UnitZ();  ///< the object's way up (ObjectUse::up)
  double upright = 0.0;                                  ///< cosine of that with up, 0 if not asked
  double score = 0.0;                                    ///< larger is better
  ContactMetrics metrics;                                ///< of the grasp that is returned
  /// Of the grasp that is returned; none when the mesh encloses no solid (WhyNotSolid).
  std::optional<GraspCertificate> certificate;
};

enum class GraspStatus {
  kFound,
  kNothingToGrasp,  ///< no two opposed places within a hand's span: too large, or no solid
  kNothingAtPlace,  ///< the same of the place asked for
  kNoHandle,        ///< asked for a handle, and there is none that a finger fits through
  kNoRoom,          ///< no way to put the hand there
  kNoCleanGrasp,    ///< hands close, but not cleanly or not firmly; the best try is returned
  kFewer,           ///< of FindGrasps: there are fewer than asked for
  kStopped,         ///< by the progress callback; the hand returned is open
};
std::string_view Describe(GraspStatus status);
std::string_view StyleName(GraspStyle style);
/// "power", "precision" or "handle"; nothing for any other name.
std::optional<GraspStyle> StyleByName(std::string_view name);
/// An option of this name: a StyleName, or "auto" for nothing.
void AddStyleOption(OptionTable& table, const std::string& name, std::optional<GraspStyle>& style,
                    std::string help);

struct GraspReport {
  GraspStatus status = GraspStatus::kNothingToGrasp;
  GraspUse use = GraspUse::kAny;  ///< what the object was taken for
  int oppositions = 0, handles = 0, placements = 0, closings = 0, refinements = 0;
  /// Each grasp that was refined to the end, best first, and why it was refused (empty: it was
  /// not).
  struct Candidate {
    Grasp grasp;
    std::string refused;
  };
  std::vector<Candidate> candidates;
  double search_ms = 0.0, closing_ms = 0.0, refinement_ms = 0.0;
};

/// Called now and then with the share of the work done, in [0, 1], from one thread at a time.
/// Returning false stops the search.
using GraspProgress = std::function<bool(double)>;

/// Closes a hand around an object. Opposed places are found on the surface and hands are put to
/// them in power and precision style; handles are found, and hands put to them with fingers
/// through. Fingers close until they touch, all is refined by least squares, and the firmest clean
/// grasp is returned. When the report's status is not kFound the grasp is the
/// least bad try, or the open hand when there was none.
///
/// `object` in its own frame, meters, with the signed distances of the same mesh.
Grasp CloseHand(const HandModel& hand, const TriangleMesh& object, const SignedDistance& surface,
                const DistanceGrid& distance, const GraspOptions& options,
                GraspReport* report = nullptr, const GraspProgress& progress = {});

/// Where the object is when the wrist has this world rotation and position.
Eigen::Isometry3d ObjectInWorld(const Grasp& grasp, const Eigen::Matrix3d& wrist_rotation,
                                const Eigen::Vector3d& wrist_position);

}  // namespace holdfast
