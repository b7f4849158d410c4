// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "generator/scripted/reach_motion.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// A demo clip and what its making reported.
struct DemoMotion {
  Clip clip;
  ScriptedReachReport report;
};

/// Right hand: lifts the embedded mug, held by its handle and upright, off a table, drinks from it
/// (`mouth` in the head joint's frame, metres: FaceMarks), turns and puts it down to the left. 4.8
/// s at 30 Hz.
DemoMotion DrinkMotion(const BodyMeasures& body, const Eigen::Vector3d& mouth);

/// Right hand: holds something before the eyes and turns it every way the wrist can. 5 s at 30 Hz.
DemoMotion InspectMotion(const BodyMeasures& body);

}  // namespace holdfast
