// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip_body.h"
#include "geometry/io/gltf/mjcf_writer.h"
#include "solver/trial/trial.h"

namespace holdfast {

/// A trial of a clip's hold.
struct ClipTrial {
  Side side = Side::kRight;
  int begin = 0, end = 0;  ///< frames of the hold; the six directions are of its first
  HoldTrial hold;
  int pieces = 0;          ///< of the object
  double excess_mm = 0.0;  ///< farthest that a piece reaches out of the surface
};

/// Tries the longest run of frames in which one hand alone holds the object; without `holding_hand`
/// all frames, by the hand that is nearer in the first. Nothing where there is none, or no object.
/// Clips of one frame have no motion of their own. Throws Error without MuJoCo, and for an object
/// without volume.
std::optional<ClipTrial> TryClip(const ClipScene& scene, const TrialProtocol& protocol = {});

/// What a scene for MuJoCo (WriteMjcf) simulates, as a trial does: the object's pieces and mass,
/// and each hand that holds it in some frames, with its links, springs and the squeeze of each
/// hold's first touch. Without `holding_hand` the nearer hand holds in all frames. `density_kg_m3`:
/// of the object, in place of the protocol's with its bounds of the mass. Nothing without an
/// object. Throws Error for an object without volume; needs no MuJoCo.
std::optional<MjcfPhysics> PhysicsOfClip(const ClipScene& scene,
                                         std::optional<double> density_kg_m3,
                                         TrialProtocol protocol = {});

/// `held_directions`, `directions` (name, holds, slips), `settling`, `clip` and what they depend
/// on.
nlohmann::json TrialJson(const ClipTrial& trial);
/// The numbers of the protocol.
nlohmann::json TrialProtocolJson(const TrialProtocol& protocol);
/// One line for people: "right hand, 0.20 kg, grip 16 N: holds in 6 of 6 directions ...".
std::string TrialText(const ClipTrial& trial);

}  // namespace holdfast
