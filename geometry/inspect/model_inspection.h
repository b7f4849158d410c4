// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// A body model, of SMPL-X, SMPL-H, MANO or in one of their layouts.
void InspectModel(Inspection& inspection);

}  // namespace holdfast
