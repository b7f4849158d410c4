// SPDX-License-Identifier: MIT
#pragma once

/// WANDR (Diomataris et al., CVPR 2024): intention-guided human motion, run without autograd.
///
///   const NetworkWeights weights = ReadNetwork("wandr.safetensors");
///   const Network<float> network(weights);
///   const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
///   const auto bones = BoneOffsetsOf(body.rest_joints).Cast<float>();
///   const Normalizer<double> normalizer(weights.statistics);
///   const auto start = StartAtRest(StandingPose(body), normalizer).Cast<float>();
///   const GoalPlan plan{{{1.5, 1.0, 1.1}, 240}};
///   const RolloutRequest request{.starts = {&start, 1}, .plans = {&plan, 1}};
///   const auto tracks = RunRollouts(network, bones, request, 2);
///   WriteClip(ClipOfStates(tracks[0].states.cast<double>()), "reach.npz");
#include "generator/wandr/motion_states.h"
#include "generator/wandr/network.h"
#include "generator/wandr/rollout.h"
