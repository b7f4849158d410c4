// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/parallel.h"
#include "solver/fit/prepared_object.h"

namespace holdfast {

/// Variation of a demonstration. All random values depend on seed and variant number.
struct VariantOptions {
  int count = 100;          ///< number of valid variants
  double scale_low = 0.85;  ///< of the object, log-uniform
  double scale_high = 1.2;
  double axis_spread = 0.06;  ///< additional random scale per axis, fraction
  double betas_sigma = 1.0;   ///< of the first two shape coefficients, clamped to 2.5 sigma
  double yaw_rad = 3.14159;   ///< maximum rotation of the scene about the vertical
  double place_m = 0.5;       ///< maximum displacement of the scene along x and y
  double mirrored = 0.5;      ///< fraction of mirrored variants
  int bodies = 16;            ///< number of different persons
  double max_depth_mm = 2.0;  ///< in both directions, in any frame of a hold
  double touch_mm = 5.0;      ///< skin closer than this is in contact
  std::uint64_t seed = 1;
  int threads = 1;  ///< does not affect the files
};

struct VariantReport {
  bool complete = false;  ///< false: stopped by `progress`
  int tried = 0, kept = 0;
  int had = 0;                         ///< tried by an earlier run
  std::map<std::string, int> refused;  ///< counts by reason
  double seconds = 0.0;                ///< of this run
};

/// Generates variants of a clip in which hands hold an object, in `folder`: v00000.npz ..., the
/// held objects (object_000.ply, mirrored ones with _m), and manifest.jsonl: a line with the
/// request (schema holdfast/variants/1), then one per try in order: its random values, whether it
/// was kept and why not, deepest_mm, in_contact_ratio. An interrupted set is resumed.
///
/// Grasps are transferred by the scaled object's map to the new hand (GraspCarrier), without a
/// search; the object keeps its trajectory and the arms follow (BringWrists). Hand and object are
/// rigid during a hold, which is the optimum of E_d and E_c, so no per-frame solve is needed. A
/// variant is kept if it is nowhere deeper than `max_depth_mm`, in contact in every held frame, and
/// in reach. `progress`: stage "variants", kept of count. Throws Error as TransferClip does, for
/// invalid ranges, and for a folder that holds something else.
VariantReport MakeVariants(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                           const std::filesystem::path& folder, const VariantOptions& options,
                           const StagedProgress& progress = {});

}  // namespace holdfast
