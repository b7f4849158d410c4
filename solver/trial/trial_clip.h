// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
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
  int begin = 0, end = 0;  ///< frames of the hold; the six directions use the first
  HoldTrial hold;
  int pieces = 0;          ///< of the object
  double excess_mm = 0.0;  ///< maximum distance of a piece outside the surface
};

/// Tries the longest run of frames in which only one hand holds the object; without `holding_hand`
/// all frames, with the hand that is nearer in the first. Nothing if there is no such run or no
/// object. Clips of one frame are not tried along their motion. Throws Error without MuJoCo, and
/// for an object without volume.
std::optional<ClipTrial> TryClip(const ClipScene& scene, const TrialProtocol& protocol = {});

/// Returns the data for simulating a clip in MuJoCo (WriteMjcf) as in a trial: the object's pieces
/// and mass, and each hand that holds it in some frames, with its links, springs and the squeeze at
/// each hold's first contact. Without `holding_hand` the nearer hand holds in all frames.
/// `density_kg_m3`: replaces the protocol's density and mass bounds. Nothing without an object.
/// Throws Error for an object without volume; does not need MuJoCo.
std::optional<MjcfPhysics> PhysicsOfClip(const ClipScene& scene,
                                         std::optional<double> density_kg_m3,
                                         TrialProtocol protocol = {});

/// `held_directions`, `directions` (name, holds, slips), `settling`, `clip` and their parameters.
nlohmann::json TrialJson(const ClipTrial& trial);
/// The parameters of the protocol.
nlohmann::json TrialProtocolJson(const TrialProtocol& protocol);
/// One-line summary: "right hand, 0.20 kg, grip 16 N: holds in 6 of 6 directions ...".
std::string TrialText(const ClipTrial& trial);

/// Writes a video of a trial of `scene` from TryClip: the hand squeezes, then hand and object are
/// rotated to each direction in turn, with gravity always down in the image, as MuJoCo moved them.
/// A caption shows direction and slip. Throws Error as WriteVideo does.
void WriteTrialFilm(const std::filesystem::path& path, const ClipScene& scene,
                    const ClipTrial& trial, int threads = 1);

}  // namespace holdfast
