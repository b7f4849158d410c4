// SPDX-License-Identifier: MIT
#pragma once

/// Marker trajectories from optical motion capture: reads the files of laboratories as named
/// positions per frame, in meters, and writes them to a C3D.
#include "geometry/io/markers/c3d.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/io/markers/marker_tables.h"
