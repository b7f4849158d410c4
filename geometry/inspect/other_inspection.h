// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// Everything that is neither a motion, a mesh nor a body model that Holdfast reads: says what it
/// is, and what to do about it. Pickles and torch archives are searched for names, never loaded.
/// Adds to `inspection`.
void InspectOtherFile(Inspection& inspection);

}  // namespace holdfast
