// SPDX-License-Identifier: MIT
#pragma once

/// Captured, scripted or generated bodies changed so that the wrist is at its goal. Frames, feet
/// and goals go in; frames with trunk, arm and head solved, legs by inverse kinematics, come out.
///
/// From the inside out:
///   arm_ik.h             an arm for a given hand pose
///   frame_pose.h         a network's pose as a frame
///   foot_pinner.h        FootPinner: feet that stand stay, frame by frame
///   envelope.h           a smooth curve over values of frames
///   straighten_trunk.h   StraightenTrunk: nobody leans back
///   arm_swing.h          SwingArms: arms against the legs, one frame
///   level_toes.h         LevelToes: toes that do not point into the ground
///   foot_lift.h          LiftFeet: feet lifted as those of people who walk
///   wrist_placement.h    PlaceWrist: trunk and arm of one frame
///   frame_block.h        terms of a frame by four control points
///   reach_frame_block.h  the terms of a reach, 20 residuals
///   reach_warp.h         WarpReach: a captured reach to another goal
///   reach_clip.h         a synthetic reach, its labels and measures
///   reach_refit.h        RefitReach: feet and wrist after a network
///   goal_clip.h          a clip with its goals in a file
///   make_reach_data.h    MakeReachData: a data set from captures
#include "solver/body_ik/arm_ik.h"
#include "solver/body_ik/make_reach_data.h"
#include "solver/body_ik/reach_refit.h"
#include "solver/body_ik/reach_warp.h"
