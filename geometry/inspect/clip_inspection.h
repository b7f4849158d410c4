// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/inspect/inspection.h"

namespace holdfast {

/// A motion in an .npz: SMPL-X clips, SMPL-H and SMPL motions of AMASS, parameters as the smplx
/// package names them. Adds to `inspection`, whose identity tells the kind.
void InspectClip(Inspection& inspection);

/// A GRAB sequence: what its member names tell. Its parameters are Python objects: not read.
void InspectGrab(Inspection& inspection);

}  // namespace holdfast
