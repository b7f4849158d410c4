// SPDX-License-Identifier: MIT
#pragma once

/// Studies of reaches, hand-overs, grasps, solved markers and refined captures. Networks or
/// methods, protocols, objects and captured clips go in; measured motions and summaries come out,
/// those of reaches in blocks of files: a stopped study resumes.
///
/// From the inside out:
///   study_blocks.h        files of blocks, by question
///   reach_study.h         ReachStudy: WANDR's protocol by variant
///   captured_reaches.h    starts and skating of captured clips
///   listed_reaches.h      reaches from a list of starts and goals
///   reach_method_study.h  MethodStudy: methods on the same cases
///   reach_methods.h       the methods compared, baselines first
///   handover_study.h      switches found in synthetic hand-overs
///   pass_study.h          objects passed from hand to hand through a clip
///   hold_study.h          grasps tried in MuJoCo
///   track_study.h         goals that move, followed frame by frame
///   touch_study.h         touches that markers show, in solved and refined motion
///   marker_study.h        recordings of markers solved, with gaps and wrong labels
///   robot_baseline_terms.h, robot_baselines.h  hands on robots as others published it
///   robot_study.h         clips on robots' hands, beside published ways
///   capture_study.h       captured clips with objects, found, before and after refining
#include "solver/evaluation/capture_study.h"
#include "solver/evaluation/captured_reaches.h"
#include "solver/evaluation/handover_study.h"
#include "solver/evaluation/hold_study.h"
#include "solver/evaluation/listed_reaches.h"
#include "solver/evaluation/marker_study.h"
#include "solver/evaluation/pass_study.h"
#include "solver/evaluation/reach_methods.h"
#include "solver/evaluation/reach_study.h"
#include "solver/evaluation/robot_baselines.h"
#include "solver/evaluation/robot_study.h"
#include "solver/evaluation/touch_study.h"
#include "solver/evaluation/track_study.h"
