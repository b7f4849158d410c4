// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/io/mesh/load_object.h"
#include "solver/actions/action_studio.h"
#include "solver/grasp/grasp.h"

namespace holdfast {

/// A start that holds the object: a person with it in the right hand. Where it is the left hand,
/// person and object are in a mirror at x = 0 (MirrorClip, ReflectX): so will be what is made.
struct HoldingStart {
  Clip clip;
  std::unique_ptr<const ActionActor> actor;
  std::unique_ptr<const ActionProp> prop;  ///< mirrored as the clip is
  bool mirrored = false;
};

/// Goes on from this frame of a clip that shows the object in a hand, the last one if none is
/// given. Throws Error, named `source`, for a frame that is not there or in which nobody holds the
/// object, a hand alone, and positions that are no meters.
HoldingStart StartInClip(const Clip& clip, const ClipBody& body, const LoadedObject& object,
                         std::optional<int> frame = {}, int threads = 1,
                         const std::string& source = "the clip");

struct StandingHoldOptions {
  bool left = false;            ///< in the left hand
  std::optional<bool> in_hand;  ///< not on a table; none: drawn
  std::uint64_t seed = 1;
  int threads = 1;
};

enum class StandingHoldStatus {
  kMade,
  kNoGrasp,   ///< `grasp` says why
  kNobodyCan  ///< not so that the action could be done: `fault`, `detail`
};

struct StandingHold {
  StandingHoldStatus status = StandingHoldStatus::kNoGrasp;
  HoldingStart start;
  GraspStatus grasp{};
  std::string fault, detail;
};

/// A person of this body who stands and has the object in the hand, on a table or before the waist,
/// so that the action (its label) can be done with it. Throws Error for a hand alone.
StandingHold MakeStandingHold(const ClipBody& body, const LoadedObject& object,
                              std::string_view action, const StandingHoldOptions& options = {});

}  // namespace holdfast
