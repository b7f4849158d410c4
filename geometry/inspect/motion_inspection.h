// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// Inspects a BVH or ASF/AMC motion: skeleton, unit, up axis, discontinuities.
void InspectMotion(Inspection& inspection);

/// Inspects an Acclaim skeleton without motion.
void InspectAsf(Inspection& inspection);

/// Inspects a clip or a file meant as one: its arrays as stored, and what ReadClip would reject.
void InspectClip(Inspection& inspection);

}  // namespace holdfast
