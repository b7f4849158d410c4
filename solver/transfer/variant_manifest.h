// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/body/own_body.h"
#include "geometry/clip/clip.h"
#include "solver/fit/prepared_object.h"
#include "solver/transfer/carried_grasp.h"
#include "solver/transfer/transfer.h"

namespace holdfast {

/// Tries that a manifest has, and the lines of it that are whole.
struct VariantManifest {
  int tried = 0, kept = 0;
  std::string text;
  std::map<std::string, int> refused;
};

/// Of a folder of variants with what was asked, the first line. Empty where nothing is there yet.
/// Throws Error for a folder that holds something else, or variants of other `asked`.
VariantManifest ReadManifest(const std::filesystem::path& path, const nlohmann::json& asked);

/// Depth both ways and contact of a hold, frame after frame. Where skin near the object has moved
/// by little since a frame that was measured, nothing is deeper or farther off than it was by more.
struct HoldMeasure {
  double deepest_mm = 0.0;
  int frames = 0, touching = 0;
};

/// Of the frames of `hold`, with skin nearer than `touch_m` in contact.
HoldMeasure MeasureHold(const Clip& clip, const CarryingHand& hand, const GraspCarrier& carrier,
                        const PreparedObject& object, const TransferredHold& hold, double touch_m);

/// How deep the object is in the person's body, meters: the most of ten frames in which it is held.
double DepthInBody(const Clip& clip, const BodySurface& skin, const OwnBody& obstacle,
                   const PreparedObject& object);

}  // namespace holdfast
