// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// A BVH or ASF/AMC motion: skeleton, unit, up axis, leaps. Adds to `inspection`.
void InspectMotion(Inspection& inspection);

/// An Acclaim skeleton without motion.
void InspectAsf(Inspection& inspection);

/// A clip, or what is meant as one: its arrays as they are, and what ReadClip would refuse.
void InspectClip(Inspection& inspection);

}  // namespace holdfast
