// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// A recording of markers: names, rate, unit, extent, gaps, and jumps that no hand makes.
void InspectMarkers(Inspection& inspection);

}  // namespace holdfast
