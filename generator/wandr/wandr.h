// SPDX-License-Identifier: MIT
#pragma once

/// WANDR (Diomataris et al., CVPR 2024): intention-guided human motion, run without autograd.
///
///   const NetworkWeights weights = ReadNetwork("wandr.safetensors");
///   const Network<float> network(weights);
///   const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
///   const auto bones = BoneOffsetsOf(body.rest_joints).Cast<float>();
///   const Normaliser<double> normaliser(weights.statistics);
///   const auto start = StartAtRest(StandingPose(body), normaliser).Cast<float>();
///   const GoalPlan plan{{{1.5, 1.0, 1.1}, 240}};
///   const RolloutRequest request{.starts = {&start, 1}, .plans = {&plan, 1}};
///   const auto tracks = RunRollouts(network, bones, request, 2);
///   WriteClip(ClipOfStates(tracks[0].states.cast<double>()), "reach.npz");
///
/// From the inside out, each with its vector-Jacobian product beside it:
///   rotation_6d.h      rotations as six numbers, Gram-Schmidt
///   heading.h          the heading frame Z, the root without it
///   pose.h             the state s (135), its tangent (69)
///   pose_delta.h       the delta d (135), s' = step(s, d)
///   body_kinematics.h  22 joints
///   intention.h        I^w, I^p, I^r
///   statistics.h       normalisation
///   condition.h        c = [pose | previous delta | intention] (277)
///   network.h          encoder, decoder, weights files (layers: generator/nn/mlp.h)
///   default_network.h  embedded weights; reach_network.h: these or a file's
///   goal_plan.h        waypoints and deadlines
///   walk_pace.h        turn, walk and reach: when to be where, when a goal is due
///   rollout.h          the closed loop and its gradient; run_rollouts.h: many, on threads
///   motion_states.h    clips in and out, where rollouts start
///   reach_outcome.h    success and timing of one reach; reach_skating.h: foot skating
///   reach_goals.h      goals one after another, best of many
///   reach_starts.h     start poses of the evaluation
///   reach_protocol.h   the published evaluation
///   training_frames.h  hindsight goals, what a network is trained on
#include "generator/wandr/motion_states.h"
#include "generator/wandr/network.h"
#include "generator/wandr/rollout.h"
#include "generator/wandr/run_rollouts.h"
#include "generator/wandr/training_frames.h"
