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
#include "solver/carry/fit_job.h"
#include "solver/synthesis/face_refit.h"
#include "solver/synthesis/holding_start.h"
#include "solver/synthesis/motion_passes.h"
#include "solver/synthesis/synthesis.h"

/// A motion for a person who holds an object and an intent: key frames by IMoS's loop, the best of
/// several samples, synthetic motion; what belongs at the face is brought there (RefitAtFace).
/// CarryObject fits the object to all of its frames.
///
///   HoldingStart start = MakeStandingHold(body, LoadObject("mug"), "drink").start;
///   SynthesizedMotion made = Synthesize(start, imos::DefaultNetwork(), intent, {});
///   CarryReport carried = CarryObject(made.motion, body, PrepareObject(LoadObject("mug")));
namespace holdfast {

struct SynthesizeOptions {
  double seconds_per_key_frame = 0.2;
  int key_frames = imos::kNumKeyFrames;  ///< with those of the start
  int samples = 8;                       ///< motions to choose from
  double sigma = 1.0;                    ///< of the latents
  double style = 1.0;      ///< how much samples differ in pace and posture (SampleStyle); 0: not
  bool keep_pace = false;  ///< all samples take the time that was asked for; the start may wait
  bool finish_all =
      false;  ///< AddReturn and all that follows of all samples, not of the best alone
  double frame_rate = 30.0;  ///< Hz, of the motion
  /// The object goes back to where it was (AddReturn); on a table the hand lets go of it.
  bool and_back = false;
  /// (29 x E) embeddings of the actions; none: the networks' own.
  std::optional<Eigen::MatrixXf> action_table;
  std::uint64_t seed = 1;
  int threads = 1;  ///< the result does not depend on them
};

struct SynthesizedSample {
  Synthesized keys;
  Clip motion;  ///< in the world of the start
  /// What is wrong with it, in units of what a synthetic clip may have at most; of the best three
  /// (all, with finish_all) once what belongs at the face is there.
  double faults = 0.0;
  int number = 0;   ///< before they were ranked
  int hurried = 0;  ///< frames of standing still that were left out (TrimIdle)
  SampleStyle style;
};

struct SynthesizedMotion {
  bool stopped = false;             ///< by `progress`
  Clip motion;                      ///< of the best sample, out of the mirror again
  std::optional<int> switch_frame;  ///< in which the other hand takes the object over
  Side first_hand = Side::kRight;
  bool lets_go = false;                    ///< at the end: CarryOptions::clear_passages
  std::vector<SynthesizedSample> samples;  ///< best first, right-handed (MirrorClip for the left)
  double loop_s = 0.0;                     ///< of making all key frames
};

/// How near what the action brings to the face comes to it in a clip of the start's person, as
/// Synthesize or the fit after it have left it. Nothing for actions without a place at the face.
std::optional<FaceDistance> NearestToFace(const HoldingStart& start, std::string_view action,
                                          const Clip& clip);

SynthesizedMotion Synthesize(const HoldingStart& start, const imos::NetworkWeights& network,
                             const imos::Intent& intent, const SynthesizeOptions& options = {},
                             const StagedProgress& progress = {});

/// A synthesis as the command line or Python asks for it.
struct SynthesisJob {
  std::string object_class;       ///< name of the vocabulary; empty: the object's own
  std::optional<double> seconds;  ///< of the whole motion; none: as long as the action usually is
  double object_scale = 1.0;
  StandingHoldOptions standing;  ///< of a start that is made
  SynthesizeOptions options;
};

/// The options of `synthesize`.
OptionTable OptionsOf(SynthesisJob& job);

/// Actions that the networks know and, where a start is to be made, that one can be made for.
std::vector<std::string> OfferedActions(const SynthesisNetwork& network, bool makes_start);

/// Throws Error about `where` for an action that is not offered.
void RequireOffered(const imos::Intent& intent, const std::vector<std::string>& offered,
                    const std::string& where);

/// A sentence where the networks have seen the action, and never with the object.
std::optional<std::string> NoteOnIntent(const SynthesisNetwork& network,
                                        const imos::Intent& intent);

/// A person of `body` who stands and has the object (called `name`) in the hand, on a table or
/// before the waist. Throws FitFailure where nobody can.
HoldingStart MakeStart(const ClipBody& body, const LoadedObject& object, const std::string& name,
                       std::string_view action, const StandingHoldOptions& options);

/// Sets what the job's options come to for an action of the network, and makes the motion.
SynthesizedMotion Synthesize(SynthesisJob& job, const HoldingStart& start,
                             const SynthesisNetwork& network, const imos::Intent& intent,
                             const StagedProgress& progress = {});

/// The fit of the object to the motion that was made.
FitJob FitOf(const SynthesisJob& job, const SynthesizedMotion& made, const std::string& object);

}  // namespace holdfast
