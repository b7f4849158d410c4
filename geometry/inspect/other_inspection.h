// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// Inspects any file that is neither a motion, a mesh nor a body model that Holdfast reads: reports
/// what the file is and what to do about it. Adds to `inspection`.
void InspectOtherFile(Inspection& inspection);

/// Inspects a surface mesh (.obj .ply .stl .off .glb .gltf by content): size, unit, whether it is
/// closed and valid, and what loading repairs. Adds to `inspection`.
void InspectMesh(Inspection& inspection);

/// Inspects a marker recording: names, rate, unit, extent, gaps, and jumps that no hand makes.
void InspectMarkers(Inspection& inspection);

}  // namespace holdfast
