// SPDX-License-Identifier: MIT
#pragma once

/// IMoS (Ghosh et al., Eurographics 2023): what a person does with an object they hold, key frame
/// by key frame, from an action, the object's class and the person's shape. Run without autograd.
///
///   const NetworkWeights weights = ReadNetwork("imos.safetensors");
///   const Network<float> network(weights);
///   const SynthesisStart start =
///       StartOf(sequence, weights.config.object_rotation, ActionTable(weights));
///   const auto tracks = RunSynthesis(network, {.starts = {&start, 1}, .seed = 1},
///       [&](int sample, int frame, const wandr::Pose<double>& pose) {
///         return ObjectColumn(R, T, weights.config.object_rotation);  // fitted to this pose
///       }, 2);
///   tracks[0].Pose(14);
///
/// From the inside out, each with its vector-Jacobian product beside it:
///   vocabulary.h       29 actions, 54 objects, sentences
///   config.h           what the networks see, options, sizes, names of tensors
///   res_block.h        residual blocks, batch norms folded
///   attention.h        self-attention of the joints of one pose
///   weights.h          weights files; import_weights.h: published checkpoints
///   default_network.h  embedded weights; synthesis_network.h: these or a file's
///   network.h          both modules ready to run
///   step.h             one key frame from the k before
///   rollout.h          the loop, batched, and its gradient
///   run_synthesis.h    many samples on threads, objects by a callback
///   key_frames.h       which moments of a clip are key frames
///   action_sequence.h  key frames of clips, canonical frame
///   action_set.h       sequences of folders, split by subject
///   recognition.h      the action classifier that evaluation uses
///   synthesis_metrics.h, synthesis_metrics_motion.h, face_error.h: the evaluation's measures
#include "generator/imos/action_sequence.h"
#include "generator/imos/network.h"
#include "generator/imos/rollout.h"
#include "generator/imos/run_synthesis.h"
