// SPDX-License-Identifier: MIT
#pragma once

/// Clips for other programs. A clip with its body and object goes in; a file in the format that its
/// name asks for comes out.
///
/// From the inside out:
///   export_clip.h  ExportClip: any format
#include "geometry/export/export_clip.h"
