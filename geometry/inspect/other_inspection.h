// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// Everything that is neither a motion, a mesh nor a body model that Holdfast reads: says what it
/// is, and what to do about it. Pickles and torch archives are searched for names, never loaded.
/// Adds to `inspection`.
void InspectOtherFile(Inspection& inspection);

/// A surface mesh (.obj .ply .stl .off .glb .gltf by content): size, unit, whether it is closed and
/// sound, and what is repaired when it is loaded. Adds to `inspection`.
void InspectMesh(Inspection& inspection);

/// A recording of markers: names, rate, unit, extent, gaps, and jumps that no hand makes.
void InspectMarkers(Inspection& inspection);

}  // namespace holdfast
