// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/convex_pieces.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/grasp/grasp_set.h"
#include "solver/trial/trial_hand.h"
#include "solver/trial/trial_scene.h"

/// Grasp stability in an independent physics engine (MuJoCo, an optional component): measures how
/// far an object moves in a hand under gravity in six directions, and along the clip's own motion.
/// docs/metrics.md has the protocol. No search uses it.

namespace holdfast {

struct TrialProtocol {
  double density_kg_m3 = 500.0;                     ///< of the object, filled
  double least_mass_kg = 0.05, most_mass_kg = 0.5;  ///< bounds of volume times density
  double gravity_m_s2 = 9.81;
  double touch_m = 0.003;                          ///< skin closer than this presses
  double grip_weights = 8.0, least_grip_N = 10.0;  ///< sum of all contact forces
  double settle_s = 0.5;                           ///< initial squeeze without gravity
  /// Drag on the object meanwhile: pieces that overlap as fitted separate without ejecting it.
  double settle_drag_per_s = 100.0;
  double hold_s = 1.0;                     ///< per gravity direction
  double most_mm = 30.0, most_deg = 30.0;  ///< larger displacement or rotation: not held
  double frame_rate = 30.0;                ///< of the recording
  FingerStrength fingers;
  TrialSceneOptions scene;
  ConvexPieceOptions pieces;
  int threads = 1;  ///< does not affect the result
};

/// Gravity directions: +x, -x, +y, -y, +z, -z of the object's frame as held.
inline constexpr int kTrialDirections = 6;
std::string_view TrialDirectionName(int direction);
Eigen::Vector3d TrialDirection(int direction);

/// An object prepared for many trials.
struct TrialSolid {
  std::vector<TriangleMesh> pieces;
  double excess_mm = 0.0;       ///< maximum distance of a piece outside the surface
  SolidMass mass;               ///< of the protocol
  double radius_m = 0.0;        ///< maximum distance of the object's vertices from the mass center
  bool mass_of_pieces = false;  ///< open surface: mass and inertia are those of the pieces
};

/// Throws Error for a mesh without volume.
TrialSolid MakeTrialSolid(const TriangleMesh& mesh, const SignedDistance& distance,
                          const TrialProtocol& protocol);

/// One simulation run.
struct TrialCourse {
  bool holds = false;
  bool touches = false;   ///< at the end
  bool stable = true;     ///< false: MuJoCo diverged, and the object does not hold
  double slip_mm = 0.0;   ///< of the mass center in the hand, from start to end
  double slip_deg = 0.0;  ///< of the object in the hand
  double most_slip_mm = 0.0, most_slip_deg = 0.0;   ///< maximum over the run
  std::vector<Eigen::Isometry3d> hand_from_object;  ///< at `frame_rate`, including the start
  std::vector<FingerPose> fingers;                  ///< of a hand
};

struct HoldTrial {
  double mass_kg = 0.0;
  double grip_N = 0.0;   ///< sum of normal forces, 0 without contact
  int pressing = 0;      ///< contacts that press
  TrialCourse settling;  ///< from the fitted pose: squeezed without gravity
  /// From the settled state. A grasp that is lost while settling holds in none.
  std::array<TrialCourse, kTrialDirections> directions;
  std::optional<TrialCourse> clip;  ///< along the clip's motion, from the settled state

  int Held() const;             ///< directions of 6
  double WorstSlip_mm() const;  ///< over the directions, at their ends
  double WorstSlip_deg() const;
};

/// A hand's motion, per frame, for the trial along the clip.
struct HandMotion {
  double frame_rate = 30.0;
  std::vector<Eigen::Isometry3d> world_from_wrist;
  std::vector<FingerPose> fingers;
};

/// Tries a hand given by links and contacts (with forces), with `motion` also along it. Throws
/// Error without MuJoCo (RequirePhysics).
HoldTrial TryHold(const std::vector<MjcfLink>& links, const std::vector<GripContact>& contacts,
                  const TrialSolid& solid, const Eigen::Isometry3d& hand_from_object,
                  const TrialProtocol& protocol, const HandMotion* motion = nullptr);

/// Returns the contacts of a hand with the object, with the squeeze (BalancePresses) of the
/// protocol; wrist's frame.
std::vector<GripContact> PressesOfHand(const HandState& state,
                                       const Eigen::Isometry3d& world_from_object,
                                       const TrialSolid& solid, const SignedDistance& distance,
                                       const TrialProtocol& protocol);

/// Tries a hand that holds the object in the pose of `state` (set and evaluated). With `motion`,
/// whose frame 0 is that pose, also along it, with gravity along the world's -z.
HoldTrial TryHold(const HandState& state, const Eigen::Isometry3d& world_from_object,
                  const TrialSolid& solid, const SignedDistance& distance,
                  const TrialProtocol& protocol, const HandMotion* motion = nullptr);

/// Tries many grasps of one object (FindGrasps) in the six directions each, on `protocol.threads`
/// threads. `progress` is called with the completed fraction, in (0, 1], from one thread at a time;
/// once it returns false, trials not yet begun stay empty: held in none. Throws Error without
/// MuJoCo, and for an object without volume.
std::vector<HoldTrial> TryGrasps(const HandModel& hand, const TriangleMesh& object,
                                 std::span<const CertifiedGrasp> grasps,
                                 const TrialProtocol& protocol = {},
                                 const std::function<bool(double)>& progress = {});

}  // namespace holdfast
