// SPDX-License-Identifier: MIT
#pragma once

/// What a file is, whether it is sound and what to do with it: a path comes in; facts, findings
/// and commands come out, and nothing is thrown for any content.
///
/// From the inside out:
///   convert_commands.h   shell commands that repair a clip
///   clip_findings.h      posture, hands, object and leaps in words
///   clip_inspection.h    clips, against what ReadClip refuses
///   model_inspection.h   body models of any kind
///   data_inspection.h    files of named values, scenes
///   mesh_inspection.h    meshes: size, unit, whether closed
///   motion_inspection.h  BVH and ASF/AMC
///   marker_inspection.h  recordings of markers
///   other_inspection.h   all other files: what they are
///   inspection.h         Inspection, which all fill; Inspect
#include "geometry/inspect/inspection.h"
