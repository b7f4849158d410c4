// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/parallel.h"
#include "solver/fit/prepared_object.h"

namespace holdfast {

/// What variants of a demonstration differ by. Every draw is by the seed and the variant's number.
struct VariantOptions {
  int count = 100;          ///< valid ones wanted
  int most_tries_each = 8;  ///< given up after so many times `count`, or 256
  double scale_low = 0.85;  ///< of the object, evenly in its logarithm
  double scale_high = 1.2;
  double axis_spread = 0.06;  ///< each axis besides, by up to this share more or less
  double betas_sigma = 1.0;   ///< of the first two shape coefficients, at most 2.5 of it
  double yaw_rad = 3.14159;   ///< the whole scene turns about the vertical by up to this
  double place_m = 0.5;       ///< and stands elsewhere by up to this, along x and y
  double mirrored = 0.5;      ///< share of the left-right mirrored ones
  int per_shape = 32;         ///< tries that share an object's shape: preparing it costs most
  int bodies = 16;            ///< different persons
  double max_depth_mm = 2.0;  ///< both ways, in any frame of a hold
  double max_body_mm = 5.0;   ///< of the object in the person, in any of ten frames
  double touch_mm = 5.0;      ///< a hand is in contact where skin is nearer than this
  std::uint64_t seed = 1;
  int threads = 1;  ///< the files do not depend on it
};

struct VariantReport {
  bool complete = false;  ///< false: stopped by `progress`
  int tried = 0, kept = 0;
  int had = 0;             ///< of those tried, by an earlier run
  nlohmann::json refused;  ///< counts by reason
  double seconds = 0.0;    ///< of this run
};

/// Makes variants of a clip in which hands hold an object, in `folder`: v00000.npz ..., the objects
/// they hold (object_000.ply, mirrored ones with _m), and manifest.jsonl: a line with what was
/// asked (schema holdfast/variants/1), then one for each try in order: its draws, whether it was
/// kept and why not, deepest_mm, in_contact_ratio. A set that was stopped goes on where it was.
///
/// Grasps are carried over the scaled object's map to the new hand (GraspCarrier), without a
/// search; the object keeps its way and the arms follow (BringWrists). Hand and object are rigid
/// while a hand holds, which is the optimum of E_d and E_c, so that nothing is left to solve from
/// frame to frame. Kept is what is nowhere deeper than `max_depth_mm`, in contact in every frame
/// held, and in reach. `progress`: stage "variants", kept of count. Throws Error as TransferClip
/// does, for ranges that are none, and for a folder that holds something else.
VariantReport MakeVariants(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                           const std::filesystem::path& folder, const VariantOptions& options,
                           const StagedProgress& progress = {});

}  // namespace holdfast
