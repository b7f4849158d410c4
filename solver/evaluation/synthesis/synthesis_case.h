// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "generator/imos/action_sequence.h"
#include "generator/imos/network.h"
#include "generator/imos/synthesis_metrics_motion.h"
#include "generator/imos/synthesis_network.h"
#include "geometry/clip/clip_body.h"
#include "solver/fit/prepared_object.h"

namespace holdfast {

/// Where the object is in a key frame that was just made.
enum class ObjectMode {
  kGiven,    ///< where it truly was, as the authors' evaluation has it: the motion cannot err in it
  kCarried,  ///< rigidly with the wrist that truly carries it
  kFitted,   ///< where the fit puts it: the loop that 'synthesize' runs, and its fit of all frames
};
std::string ObjectModeName(ObjectMode mode);

/// A held-out sequence with all that it takes to go on from its beginning and to measure what
/// comes.
struct SynthesisCase {
  imos::ActionSequence sequence;
  ClipScene scene;  ///< the clip it is of; its object's mesh is not kept
  Clip keys;        ///< its key frames, in the clip's world
};

/// `sequence` is of the clip of `scene`, whose object LoadObject finds by its `object_source`, and
/// made by `rule`. Nothing where nobody holds the object in the last key frame that is given.
std::optional<SynthesisCase> SynthesisCaseOf(imos::ActionSequence sequence, ClipScene scene,
                                             imos::KeyFrameRule rule);

/// Networks under evaluation, ready to run.
struct RatedNetwork {
  RatedNetwork(std::string called, SynthesisNetwork from)
      : name(std::move(called)), loaded(std::move(from)), network(loaded.weights) {}

  std::string name;
  SynthesisNetwork loaded;
  imos::Network<float> network;
};

/// What was made of a case.
struct SynthesizedCase {
  Clip keys;                       ///< 15 key frames in the case's world, with object
  std::optional<Clip> finished;    ///< of kFitted: all frames, fitted
  double seconds = 0.0;            ///< one core, of the key frames with their object
  double finishing_seconds = 0.0;  ///< of `finished`
};

/// Case i of all of them draws from stream `repeat` * `total` + i of `seed`; `cases` begin with
/// number `first`. Fitted ones are fitted in all frames too where `finish` says so of the case
/// (none where it is empty). The result does not depend on `threads`. With `timed`, given and
/// carried ones are made one by one to know how long they take. What is fitted after `stopped` says
/// so, on any thread, is left empty.
struct SynthesisOrder {
  ObjectMode mode = ObjectMode::kGiven;
  std::uint64_t seed = 1;
  int repeat = 0, total = 0, first = 0;
  double sigma = 1.0;
  std::vector<bool> finish = {};
  bool timed = false;
  int threads = 1;
  std::function<bool()> stopped = [] { return false; };
};
std::vector<SynthesizedCase> SynthesizeCases(const RatedNetwork& network,
                                             std::span<const SynthesisCase> cases,
                                             const SynthesisOrder& order, FitLibrary& library);

/// The seed's last key frame for all that follow: what knows nothing of actions. The object stays.
Clip HeldStill(const SynthesisCase& one);

/// Joints of key frames in the case's canonical frame, (66 x T).
imos::JointMotion JointsOf(const Clip& keys, const SynthesisCase& one);

/// The object's translation as the head has it (imos::FaceError), (3 x T).
Eigen::Matrix3Xd ObjectFromHead(const Clip& keys, const SynthesisCase& one);

}  // namespace holdfast
