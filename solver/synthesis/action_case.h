// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "generator/imos/action_sequence.h"
#include "generator/imos/network.h"
#include "generator/imos/synthesis_network.h"
#include "geometry/clip/clip_body.h"
#include "solver/fit/prepared_object.h"

namespace holdfast {

/// Where the object is in a key frame that was just generated.
enum class ObjectMode {
  kGiven,    ///< ground truth, as the authors' evaluation has it: the motion cannot err in it
  kCarried,  ///< fixed to the wrist that truly carries it
  kFitted,   ///< where the fit puts it: the loop that 'synthesize' runs, and its fit of all frames
};

/// A captured action that networks continue from its first key frames.
struct ActionCase {
  imos::ActionSequence sequence;
  ClipScene scene;  ///< the clip it is of
  Clip keys;        ///< its key frames, in the clip's world
};

/// `sequence` is of the clip of `scene`, whose object LoadObject finds by its `object_source`, and
/// made by `rule`.
ActionCase ActionCaseOf(imos::ActionSequence sequence, ClipScene scene, imos::KeyFrameRule rule);

/// A network, ready to run.
struct CaseNetwork {
  explicit CaseNetwork(SynthesisNetwork from) : loaded(std::move(from)), network(loaded.weights) {}

  SynthesisNetwork loaded;
  imos::Network<float> network;
};

/// What was generated for a case.
struct MadeCase {
  Clip keys;                       ///< 15 key frames in the case's world, with object
  std::optional<Clip> finished;    ///< of kFitted: all frames, fitted
  double seconds = 0.0;            ///< one core, of the key frames with their object
  double finishing_seconds = 0.0;  ///< of `finished`
};

struct CaseOptions {
  ObjectMode mode = ObjectMode::kGiven;
  std::uint64_t seed = 1, stream = 0;  ///< latents are drawn from this stream of `seed`
  std::uint64_t stroke_seed = 1;       ///< of the strokes laid into fitted motion
  double sigma = 1.0;                  ///< of the latents
  bool finish = false;                 ///< kFitted: fit all frames too
};
MadeCase MakeCase(const CaseNetwork& network, const ActionCase& one, const CaseOptions& options,
                  FitLibrary& library);

/// Joints of key frames in the case's canonical frame, (66 x T), meters.
Eigen::MatrixXd JointsOf(const Clip& keys, const ActionCase& one);

/// The object's translation in the frame of the head joint, (3 x T) meters.
Eigen::Matrix3Xd ObjectFromHead(const Clip& keys, const ActionCase& one);

}  // namespace holdfast
