// SPDX-License-Identifier: MIT
#pragma once

/// Scripts of actions with an object: an action, an object and a person who stands come in; poses
/// of object, wrist, gaze and trunk over time come out, which solver/actions turns into motion.
///
/// From the inside out:
///   object_marks.h    rim, spout and the like of objects
///   face_marks.h      mouth, nose, eyes and ear
///   face_place.h      where at the face an action brings an object
///   action_path.h     where a wrist is wanted over time
///   action_strokes.h  rhythms laid over motion that has none
///   action_catalog.h  actions and the objects they use
///   script_poses.h    object poses that place a point
///   script_writer.h   a script, key after key
///   script_intents.h  one function for each action
///   action_script.h   ActionScript, which WriteScript gives
///   standing_start.h  people who stand, captured or not
///   action_starts.h   such starts of a folder
#include "generator/actions/action_catalog.h"
#include "generator/actions/action_script.h"
#include "generator/actions/action_starts.h"
#include "generator/actions/standing_start.h"
