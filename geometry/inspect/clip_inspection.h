// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// A clip, or what is meant as one: its arrays as they are, and what ReadClip would refuse.
void InspectClip(Inspection& inspection);

}  // namespace holdfast
