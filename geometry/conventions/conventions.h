// SPDX-License-Identifier: MIT
#pragma once

/// Which conventions a motion was written in, measured on the motion itself. An archive or a clip
/// comes in; up axis, unit, kind of finger angles and of object rotation come out.
///
/// From the inside out:
///   series.h         median, and steps that leap
///   loose_motion.h   motion in whatever names and forms
///   posture.h        up axis, unit, ground; leaps, overbent joints
///   hand_evidence.h  mean hand, object rotation, carrying hand
#include "geometry/conventions/hand_evidence.h"
#include "geometry/conventions/loose_motion.h"
#include "geometry/conventions/posture.h"
