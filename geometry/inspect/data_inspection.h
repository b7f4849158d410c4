// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// Inspects a file of named values (numpy, pickle, torch, JSON, safetensors) or a scene with a
/// motion. Lists its content and reports whether it is a motion that import accepts (then with
/// everything reported for a clip), a body model, or network weights.
void InspectData(Inspection& inspection);

/// Inspects a body model: SMPL-X, SMPL-H, MANO, or a model in one of their layouts.
void InspectModel(Inspection& inspection);

}  // namespace holdfast
