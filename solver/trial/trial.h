// SPDX-License-Identifier: MIT
#pragma once

/// Whether a grasp would hold, judged by an engine that had no part in making it (MuJoCo, an
/// optional component). A hand, its pose and an object go in; how far the object moves in the
/// hand while gravity pulls in six directions, and along the clip's own motion, comes out.
/// docs/metrics.md has the protocol. No search uses it.

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/convex_pieces.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/trial/trial_hand.h"
#include "solver/trial/trial_scene.h"

namespace holdfast {

struct TrialProtocol {
  double density_kg_m3 = 500.0;                     ///< of the object, filled
  double least_mass_kg = 0.05, most_mass_kg = 0.5;  ///< what volume times density is clipped to
  double gravity_m_s2 = 9.81;
  double touch_m = 0.003;                          ///< skin closer than this presses
  double grip_weights = 8.0, least_grip_N = 10.0;  ///< pushes of all contacts, summed
  double settle_s = 0.5;                           ///< squeezed without gravity, first
  /// Drag on the object meanwhile: pieces that overlap as fitted part without throwing it.
  double settle_drag_per_s = 100.0;
  double hold_s = 1.0;                     ///< in each direction of gravity
  double most_mm = 30.0, most_deg = 30.0;  ///< moved or turned farther: not held
  double frame_rate = 30.0;                ///< of what is recorded
  FingerStrength fingers;
  TrialSceneOptions scene;
  ConvexPieceOptions pieces;
  int threads = 1;  ///< the result does not depend on them
};

/// +x, -x, +y, -y, +z, -z of the object's frame as it is in the hand: where gravity pulls.
inline constexpr int kTrialDirections = 6;
std::string_view TrialDirectionName(int direction);
Eigen::Vector3d TrialDirection(int direction);

/// An object as trials have it, made once for many of them.
struct TrialSolid {
  std::vector<TriangleMesh> pieces;
  double excess_mm = 0.0;       ///< farthest that a piece reaches out of the surface
  SolidMass mass;               ///< of the protocol
  double radius_m = 0.0;        ///< of the object's vertices about the mass center, largest
  bool mass_of_pieces = false;  ///< the surface is open: mass and inertia are the pieces'
};

/// Throws Error for a mesh that spans no volume.
TrialSolid MakeTrialSolid(const TriangleMesh& mesh, const SignedDistance& distance,
                          const TrialProtocol& protocol);

/// One course of events.
struct TrialCourse {
  bool holds = false;
  bool touches = false;   ///< at the end
  bool stable = true;     ///< else MuJoCo gave up, and it does not hold
  double slip_mm = 0.0;   ///< of the mass center in the hand, from the start to the end
  double slip_deg = 0.0;  ///< of the object in the hand
  double most_slip_mm = 0.0, most_slip_deg = 0.0;   ///< largest on the way
  std::vector<Eigen::Isometry3d> hand_from_object;  ///< at `frame_rate`, the start first
  std::vector<FingerPose> fingers;                  ///< of a hand
};

struct HoldTrial {
  double mass_kg = 0.0;
  double grip_N = 0.0;       ///< sum of pushes, 0 where nothing touches
  int pressing = 0;          ///< contacts that press
  int fingers_pressing = 0;  ///< those of fingers
  TrialCourse settling;      ///< from the fitted pose: squeezed without gravity
  /// From where it has settled. A grasp that is lost while settling holds in none.
  std::array<TrialCourse, kTrialDirections> directions;
  std::optional<TrialCourse> clip;  ///< along the clip's motion, from where it has settled

  int Held() const;             ///< directions of 6
  double WorstSlip_mm() const;  ///< of the directions, at their ends
  double WorstSlip_deg() const;
};

/// What the hand of links and contacts (forces set) makes of the object. Throws Error without
/// MuJoCo (RequirePhysics).
HoldTrial TryHold(const std::vector<TrialLink>& links, const std::vector<GripContact>& contacts,
                  const TrialSolid& solid, const Eigen::Isometry3d& hand_from_object,
                  const TrialProtocol& protocol);

/// Where a hand touches the object, and the squeeze there (BalancePresses) that the protocol asks
/// for; wrist's frame.
std::vector<GripContact> PressesOfHand(const HandState& state,
                                       const Eigen::Isometry3d& world_from_object,
                                       const TrialSolid& solid, const SignedDistance& distance,
                                       const TrialProtocol& protocol);

/// A hand's motion, frame by frame: what the clip's own trial follows.
struct HandMotion {
  double frame_rate = 30.0;
  std::vector<Eigen::Isometry3d> world_from_wrist;
  std::vector<FingerPose> fingers;
};

/// The same for a hand that holds the object in the pose that `state` has (set and evaluated). With
/// `motion`, whose frame 0 that pose is, along it too, gravity down the world's z.
HoldTrial TryHold(const HandState& state, const Eigen::Isometry3d& world_from_object,
                  const TrialSolid& solid, const SignedDistance& distance,
                  const TrialProtocol& protocol, const HandMotion* motion = nullptr);

}  // namespace holdfast
