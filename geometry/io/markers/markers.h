// SPDX-License-Identifier: MIT
#pragma once

/// Paths of markers from optical motion capture. A file as laboratories have them comes in; named
/// positions per frame, in meters, come out, and go back into a C3D.
#include "geometry/io/markers/c3d.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/io/markers/marker_tables.h"
