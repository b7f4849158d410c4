// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// A file of named values (numpy, pickle, torch, JSON, safetensors), or of a scene with a motion:
/// what is in it, whether it is a motion that import takes (and then all that is told of a clip), a
/// body model, or network weights.
void InspectData(Inspection& inspection);

/// A body model, of SMPL-X, SMPL-H, MANO or in one of their layouts.
void InspectModel(Inspection& inspection);

}  // namespace holdfast
