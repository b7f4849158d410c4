// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "generator/imos/action_sequence.h"
#include "generator/imos/network.h"
#include "generator/imos/synthesis_network.h"
#include "geometry/clip/clip_body.h"
#include "solver/fit/prepared_object.h"

namespace holdfast {

/// Source of the object's pose in a newly generated key frame.
enum class ObjectMode {
  kGiven,    ///< ground truth, as in the authors' evaluation: the object cannot be wrong
  kCarried,  ///< rigidly attached to the wrist that carries it in the ground truth
  kFitted,   ///< fitted: the loop of 'synthesize', with its fit of all frames
};

/// A captured action that networks continue from its first key frames.
struct ActionCase {
  imos::ActionSequence sequence;
  ClipScene scene;  ///< the sequence's clip; `object_source` is loaded by LoadObject
  Clip keys;        ///< imos::KeyFramesOf the clip, by the rule of the sequence
};

/// A network, ready for inference.
struct CaseNetwork {
  explicit CaseNetwork(const std::string& file)
      : loaded(LoadSynthesisNetwork(file)), network(loaded.weights) {}

  SynthesisNetwork loaded;
  imos::Network<float> network;
};

/// Motion generated for a case.
struct MadeCase {
  Clip keys;                       ///< 15 key frames in the case's world, with object
  std::optional<Clip> finished;    ///< kFitted only: all frames, fitted
  double seconds = 0.0;            ///< single-threaded, key frames with their object
  double finishing_seconds = 0.0;  ///< for `finished`
};

struct CaseOptions {
  ObjectMode mode = ObjectMode::kGiven;
  std::uint64_t seed = 1, stream = 0;  ///< latents use this random stream of `seed`
  std::uint64_t stroke_seed = 1;       ///< of strokes added to fitted motion
  double sigma = 1.0;                  ///< of the latents
  bool finish = false;                 ///< kFitted: also fit all frames
};
MadeCase MakeCase(const CaseNetwork& network, const ActionCase& one, const CaseOptions& options,
                  FitLibrary& library);

/// Joints of key frames in the case's canonical frame, (66 x T), meters.
Eigen::MatrixXd JointsOf(const Clip& keys, const ActionCase& one);

/// The object's translation in the frame of the head joint, (3 x T), meters.
Eigen::Matrix3Xd ObjectFromHead(const Clip& keys, const ActionCase& one);

}  // namespace holdfast
