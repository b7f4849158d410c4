// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/synthesis_network.h"
#include "generator/imos/vocabulary.h"
#include "generator/imos/weights.h"
#include "geometry/clip/clip.h"
#include "geometry/options.h"
#include "geometry/parallel.h"
#include "solver/carry/run_fit.h"
#include "solver/synthesis/holding_start.h"
#include "solver/synthesis/motion_passes.h"
#include "solver/synthesis/synthesis.h"

/// Generates motion for a person who holds an object, and an intent: key frames by IMoS's loop, the
/// best of several samples, converted to motion, and moved to the face if the action requires it
/// (RefitAtFace). CarryObject then fits the object to all frames.
///
///   HoldingStart start = MakeStandingHold(body, LoadObject("mug"), "drink").start;
///   SynthesizedMotion made = Synthesize(start, imos::DefaultNetwork(), intent, {});
///   CarryReport carried = CarryObject(made.motion, body, PrepareObject(LoadObject("mug")));
namespace holdfast {

struct SynthesizeOptions {
  double seconds_per_key_frame = 0.2;
  int key_frames = imos::kNumKeyFrames;  ///< including those of the start
  int samples = 8;                       ///< motions to choose from
  double sigma = 1.0;                    ///< of the latents
  double style = 1.0;      ///< variation of pace and posture between samples (SampleStyle); 0: none
  bool keep_pace = false;  ///< all samples have the requested duration; no idle frames removed
  bool finish_all =
      false;  ///< apply AddReturn and all later steps to all samples, not only the best
  double frame_rate = 30.0;  ///< Hz, of the motion
  /// End at rest: the object is returned to its first position, and on a table the hand releases it
  /// (AddReturn); after a handover the person stands (AddRest).
  bool and_back = true;
  /// (29 x E) embeddings of the actions; default: the networks' own.
  std::optional<Eigen::MatrixXf> action_table;
  std::uint64_t seed = 1;
  int threads = 1;  ///< does not affect the result
};

struct SynthesizedSample {
  Synthesized keys;
  Clip motion;  ///< in the world of the start
  /// Faults relative to the limits of a synthetic clip; for the best three samples (all, with
  /// finish_all) measured after the correction at the face.
  double faults = 0.0;
  int number = 0;   ///< before ranking
  int hurried = 0;  ///< idle frames removed (TrimIdle)
  SampleStyle style;
};

struct SynthesizedMotion {
  bool stopped = false;             ///< by `progress`
  Clip motion;                      ///< of the best sample, not mirrored
  std::optional<int> switch_frame;  ///< frame in which the other hand takes over the object
  Side first_hand = Side::kRight;
  bool lets_go = false;                    ///< at the end: CarryOptions::clear_passages
  std::vector<SynthesizedSample> samples;  ///< best first, right-handed (MirrorClip for the left)
  double loop_s = 0.0;                     ///< time to generate all key frames
};

/// Distance between the object and its place at the face in a clip of the start's person, after
/// Synthesize or after the fit. Nothing for actions without a place at the face.
std::optional<FaceDistance> NearestToFace(const HoldingStart& start, std::string_view action,
                                          const Clip& clip);

SynthesizedMotion Synthesize(const HoldingStart& start, const imos::NetworkWeights& network,
                             const imos::Intent& intent, const SynthesizeOptions& options = {},
                             const StagedProgress& progress = {});

/// A synthesis as specified by the command line or Python.
struct SynthesisJob {
  std::string object_class;       ///< name in the vocabulary; empty: the object's own
  std::optional<double> seconds;  ///< total duration; default: the action's typical one
  double object_scale = 1.0;
  StandingHoldOptions standing;  ///< for a generated start
  SynthesizeOptions options;
};

/// The options of `synthesize`.
OptionTable OptionsOf(SynthesisJob& job);

/// Actions that the networks know and, if `makes_start`, for which a start can be generated.
std::vector<std::string> OfferedActions(const SynthesisNetwork& network, bool makes_start);

/// Throws Error about `where` for an action that is not offered.
void RequireOffered(const imos::Intent& intent, const std::vector<std::string>& offered,
                    const std::string& where);

/// Returns a note if the networks were trained on the action, but never with this object.
std::optional<std::string> NoteOnIntent(const SynthesisNetwork& network,
                                        const imos::Intent& intent);

/// Returns a standing person of `body` with the object (called `name`) in the hand, on a table or
/// in front of the waist. Throws FitFailure if that is infeasible.
HoldingStart MakeStart(const ClipBody& body, const LoadedObject& object, const std::string& name,
                       std::string_view action, const StandingHoldOptions& options);

/// Derives the options from `job` for an action of the network, and generates the motion.
SynthesizedMotion Synthesize(SynthesisJob& job, const HoldingStart& start,
                             const SynthesisNetwork& network, const imos::Intent& intent,
                             const StagedProgress& progress = {});

/// Returns the job that fits the object to the generated motion.
FitJob FitOf(const SynthesisJob& job, const SynthesizedMotion& made, const std::string& object);

}  // namespace holdfast
