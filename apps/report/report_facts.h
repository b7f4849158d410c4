// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/clip_input.h"
#include "geometry/clip/corrective_basis.h"

namespace holdfast::apps {

/// What a clip is, for people: [[name, value], ...].
nlohmann::json FactsOf(const ClipInput& input, const BodySurface& surface,
                       const CorrectiveBasis& basis);

/// What a viewer must know before believing the picture, one sentence each.
std::vector<std::string> NotesOf(const ClipInput& input);

}  // namespace holdfast::apps
