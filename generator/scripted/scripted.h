// SPDX-License-Identifier: MIT
#pragma once

/// Motion from minimum-jerk curves: keys of a wrist or how two hands hold an object come in; clips
/// of a standing person come out.
///
/// From the inside out:
///   minimum_jerk.h     curves and splines through waypoints
///   reach_motion.h     one hand through keys; BodyMeasures
///   handover_motion.h  an object from hand to hand
#include "generator/scripted/handover_motion.h"
#include "generator/scripted/minimum_jerk.h"
#include "generator/scripted/reach_motion.h"
