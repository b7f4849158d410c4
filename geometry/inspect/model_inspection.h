// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// A body model in an .npz: of SMPL-X's layout, or another that is only named. Adds to
/// `inspection`.
void InspectModel(Inspection& inspection);

}  // namespace holdfast
