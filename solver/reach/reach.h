// SPDX-License-Identifier: MIT
#pragma once

/// Motions that bring the wrist to goals. A person, a WANDR network and goals in the world go in;
/// motions with feet pinned, ranked, and what was missed come out.
///
/// From the inside out:
///   reach_person.h     who reaches, and the motion so far
///   reach_obstacle.h   a solid to keep out of
///   reach_options.h    intention, latents or VAE + opt
///   reach_motions.h    MakeReachMotions; feet and wrist refitted
///   walk_and_reach.h   WalkAndReach: the best motion through goals
///   reach_and_take.h   ReachAndTake: an object taken from its table
///   goal_prediction.h  where a goal that moves will be
///   follow_cost.h      what a frame on its way costs
///   goal_follower.h    GoalFollower: a pose for each goal as it comes
///   goal_track.h       FollowTrack: through a table of them, measured
///   reach_json.h       a motion, a take, as metrics.json has them
///   optimised_reaches.h: MakeOptimisedReaches, a data set from captures and a network
#include "solver/reach/goal_track.h"
#include "solver/reach/optimised_reaches.h"
#include "solver/reach/reach_and_take.h"
#include "solver/reach/walk_and_reach.h"
