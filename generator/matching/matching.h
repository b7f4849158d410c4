// SPDX-License-Identifier: MIT
#pragma once

/// Motion matching: captured clips come in; walks that end in a reach come out, with feet pinned
/// and measured for faults.
///
/// From the inside out:
///   random_draws.h     the same on every standard library
///   body_frame.h       22 joints of one frame
///   sole_contact.h     heels and balls on the ground
///   support_feet.h     stance feet of motion that slides
///   leg_placement.h    legs bent to given feet
///   foot_lock.h        stance feet pinned
///   capture_quality.h  faults of a motion, joint limits
///   motion_library.h   captured clips, index of their frames
///   walk_plan.h        trajectory to a place and heading
///   motion_blend.h     inertialization between two motions
///   motion_player.h    captured motion, jumping between places
///   matched_reaches.h  walks and reaches to random goals
///   capture_set.h      a folder of captures, imported
///   set_manifest.h     manifest of a set of clips
#include "generator/matching/capture_set.h"
#include "generator/matching/foot_lock.h"
#include "generator/matching/matched_reaches.h"
#include "generator/matching/support_feet.h"
