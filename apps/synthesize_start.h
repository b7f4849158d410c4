// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "apps/fit_library.h"
#include "generator/imos/vocabulary.h"
#include "geometry/clip/clip.h"
#include "solver/actions/action_studio.h"

namespace holdfast::apps {

/// What a synthesis begins with, as the command line asks for it.
struct SynthesisBegin {
  std::string from;    ///< CLIP or CLIP:FRAME with the object held; empty: a start is made
  std::string object;  ///< mesh or embedded object
  double object_scale = 1.0;
  std::string body;
  std::vector<double> betas;    ///< of a made start
  bool left = false;            ///< the left hand
  std::optional<bool> in_hand;  ///< of a made start: in the hand, not on a table; empty: drawn
};

/// A person with the object in the right hand, ready to go on. Where the left hand was asked for,
/// person and object are in a mirror at x = 0 (MirrorClip, ReflectX): so will be what is made.
struct HeldStart {
  Clip clip;
  std::unique_ptr<const ActionActor> actor;
  std::unique_ptr<const ActionProp> prop;  ///< mirrored as the clip is
  bool mirrored = false;
  nlohmann::json how;  ///< for metrics.json
};

/// Prepares the start. Throws Error for a clip that does not show the object in a hand, an object
/// that is no size for a hand, and a body that is a hand alone; FitFailure where no hand can hold
/// the object, or not so that the action could be done.
HeldStart BeginSynthesis(const SynthesisBegin& begin, const imos::Intent& intent,
                         const CommonOptions& common);

}  // namespace holdfast::apps
