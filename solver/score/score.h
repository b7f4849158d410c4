// SPDX-License-Identifier: MIT
#pragma once

/// Measures of clips with objects. A ClipScene, and one to compare it with, go in; contact,
/// penetration, motion and errors as numbers, tables and JSON come out.
///
/// From the inside out:
///   clip_score.h     ScoreClip: all that is measured
///   metric_values.h  metrics by key, summaries over clips
///   score_output.h   table, CSV and JSON
#include "solver/score/clip_score.h"
#include "solver/score/metric_values.h"
#include "solver/score/score_output.h"
