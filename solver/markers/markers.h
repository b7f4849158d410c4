// SPDX-License-Identifier: MIT
#pragma once

/// From labelled optical markers to a body in motion. Recordings come in; a clip, with its object
/// where that has markers, and what became of each marker, come out.
///
/// From the inside out:
///   marker_trials.h       recordings of a folder, with static trials
///   marker_names.h        names of markers, and where on a body they sit
///   marked_person.h       a body model with markers: what is free, and how it rests
///   marker_world.h        units, axes, facing
///   marker_calibration.h  shape, and where each marker really sits
///   marker_track.h        poses of all frames at once; labels put right
///   object_markers.h      poses of an object with markers of its own
///   unmarked_head.h       a head without markers: out of hands' way, lips at a cup
///   solve_markers.h       SolveMarkers: the whole
///   repaired_markers.h    the recording with labels put right and gaps filled
///   marker_json.h         its report as metrics.json has it
#include "solver/markers/marked_person.h"
#include "solver/markers/marker_calibration.h"
#include "solver/markers/marker_json.h"
#include "solver/markers/marker_names.h"
#include "solver/markers/marker_track.h"
#include "solver/markers/marker_trials.h"
#include "solver/markers/marker_world.h"
#include "solver/markers/object_markers.h"
#include "solver/markers/repaired_markers.h"
#include "solver/markers/solve_markers.h"
#include "solver/markers/unmarked_head.h"
