// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "generator/reach_motion.h"
#include "geometry/clip.h"

namespace holdfast {

/// A demo clip and what its making reported.
struct DemoMotion {
  Clip clip;
  ReachReport report;
};

/// Right hand: lifts what it holds off a table, drinks from it, turns and puts it down to the
/// left. 4.8 s at 30 Hz.
DemoMotion DrinkMotion(const BodyMeasures& body);

/// Right hand: holds something before the eyes and turns it every way the wrist can. 5 s at 30 Hz.
DemoMotion InspectMotion(const BodyMeasures& body);

}  // namespace holdfast
