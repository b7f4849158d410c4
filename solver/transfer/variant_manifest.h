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

/// Number of tries in a manifest, and its complete lines.
struct VariantManifest {
  int tried = 0, kept = 0;
  std::string text;
  std::map<std::string, int> refused;
};

/// Reads the manifest of a folder of variants, whose first line is the request. Empty if there is
/// none yet. Throws Error for a folder that holds something else, or variants of another `asked`.
VariantManifest ReadManifest(const std::filesystem::path& path, const nlohmann::json& asked);

/// Depth in both directions and contact of a hold over its frames. If skin near the object has
/// moved little since a measured frame, depth and distance are bounded by that motion.
struct HoldMeasure {
  double deepest_mm = 0.0;
  int frames = 0, touching = 0;
};

/// Measures the frames of `hold`; skin closer than `touch_m` is in contact.
HoldMeasure MeasureHold(const Clip& clip, const CarryingHand& hand, const GraspCarrier& carrier,
                        const PreparedObject& object, const TransferredHold& hold, double touch_m);

/// Depth of the object in the person's body, meters: maximum over ten frames in which it is held.
double DepthInBody(const Clip& clip, const BodySurface& skin, const OwnBody& obstacle,
                   const PreparedObject& object);

}  // namespace holdfast
