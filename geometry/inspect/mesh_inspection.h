// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// A surface mesh (.obj .ply .stl .off .glb .gltf by content): size, unit, whether it is closed and
/// sound, and what is repaired when it is loaded. Adds to `inspection`.
void InspectMesh(Inspection& inspection);

}  // namespace holdfast
