// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/parallel.h"
#include "solver/carry/carry.h"

namespace holdfast {

/// An object carried through a clip in which it changes hands (CarryObject).
struct PassRow {
  std::string object;
  bool mirrored = false;  ///< the clip was
  int handovers = 0, clean = 0;
  WristChange receiver, giver;  ///< from the clip's wrists while both hold; worst of the hand-overs
  double deepest_mm = 0.0;      ///< hand and object in each other, of all frames
  /// Mean acceleration of wrists over the clip's, in frames that not both hands hold: of the hand
  /// that carries the object, and of the other one.
  double carrying_acceleration = 1.0, free_acceleration = 1.0;
  std::string fault;  ///< why nothing was carried
};

/// `options.hand_over` is set here. Nothing when `progress` stopped it.
std::optional<PassRow> TryPass(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                               CarryOptions options, const StagedProgress& progress = {});

/// The clip seen in a mirror at the world's x = 0: its hands have changed sides. Object tracks are
/// dropped, as are betas' asymmetries, which no body model has.
Clip MirroredClip(const Clip& clip, const ClipBody& body);

/// What rows without fault have on average (`deepest_mm` and both accelerations: the worst).
PassRow SummarizePasses(std::span<const PassRow> rows);

}  // namespace holdfast
