// SPDX-License-Identifier: MIT
#include "apps/motion/synthesize_job.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/motion/reach_job.h"
#include "generator/actions/action_catalog.h"
#include "generator/imos/synthesis_network.h"
#include "geometry/clip/mirror_clip.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "solver/actions/action_clip.h"
#include "solver/synthesis/synthesize.h"

namespace holdfast::apps {
namespace {

// Actions that the networks know and, where a start is to be made, that one can be made for.
std::vector<std::string> OfferedActions(const SynthesisNetwork& network, bool makes_start) {
  std::vector<std::string> offered = network.Actions();
  std::erase_if(offered, [&](const std::string& action) {
    return makes_start &&
           std::ranges::find(MadeActions(), action, &MadeAction::name) == MadeActions().end();
  });
  return offered;
}

// What the object is to the networks: as told, or what its name says.
int ObjectClass(const SynthesizeJob& job) {
  if (!job.object_class.empty()) {
    return imos::ObjectId(imos::VocabularyName(job.object_class), "--class");
  }
  const std::string named = std::filesystem::path(job.begin.object).stem().string();
  if (const auto id = imos::FindObject(imos::VocabularyName(named))) return *id;
  LoadObject(job.begin.object);  // no such file or object is another fault than one of no class
  return imos::ObjectId(named, "--class");
}

imos::Intent IntentOf(SynthesizeJob& job, const SynthesisNetwork& network) {
  const std::vector<std::string> names = OfferedActions(network, job.begin.from.empty());
  const std::vector<std::string_view> actions(names.begin(), names.end());
  imos::Intent intent;
  if (job.sentence.empty()) {
    intent = {imos::ActionId(job.action, "--action", actions), ObjectClass(job)};
  } else {
    const std::vector<std::string> meshes = EmbeddedNames("objects", "_300.ply");
    std::vector<std::string_view> objects;
    for (const std::string& mesh : meshes) objects.push_back(imos::VocabularyName(mesh));
    intent = imos::ParseSentence(job.sentence, actions, objects);
    if (job.begin.object.empty()) {
      job.begin.object = imos::EmbeddedMeshName(imos::Objects()[intent.object]);
    }
  }
  const std::string_view label = imos::Actions()[intent.action].label;
  if (std::ranges::find(actions, label) == actions.end()) {
    throw Error(job.sentence.empty() ? "--action" : fmt::format("\"{}\"", job.sentence),
                fmt::format("no motion can be generated for '{}'", label),
                fmt::format("There are: {}", fmt::join(actions, ", ")));
  }
  return intent;
}

// A note where the networks have seen the action, and never with the object; otherwise empty.
std::string NoteOnIntent(const SynthesisNetwork& network, const imos::Intent& intent) {
  const std::string action(imos::Actions()[intent.action].label);
  const std::string object(imos::Objects()[intent.object]);
  const auto seen = network.seen.find(action);
  if (seen != network.seen.end() && seen->second.is_object() && !seen->second.contains(object)) {
    std::vector<std::string> objects;
    for (const auto& [name, count] : seen->second.items()) objects.push_back(name);
    return fmt::format("note: nobody was seen who {} a {}; seen with {}",
                       imos::Actions()[intent.action].verb, object, fmt::join(objects, ", "));
  }
  return "";
}

struct SynthesisStart {
  HoldingStart held;
  nlohmann::json how;  // for metrics.json
};

// The person of the clip at its frame, up to it.
SynthesisStart FromClip(const SynthesisBegin& begin, const LoadedObject& object,
                        const CommonOptions& common) {
  const auto [name, frame] = ParseStart(begin.from);
  ClipInputOptions options;
  options.body = begin.body;
  options.object = begin.object;
  options.object_scale = begin.object_scale;
  const ClipInput input = LoadClipInput(name, options, common);
  SynthesisStart start;
  start.held =
      StartInClip(input.clip, {input.body, input.betas}, object, frame, NumThreads(common), name);
  start.how = {{"from", name}, {"frame", start.held.clip.NumFrames() - 1}};
  return start;
}

// A person who stands and has the object in the hand, on a table or before the waist.
SynthesisStart Made(const SynthesisBegin& begin, const LoadedObject& object,
                    std::string_view action, const CommonOptions& common) {
  const std::shared_ptr<const BodyModel> body = LoadBody(begin.body);
  if (static_cast<int>(begin.betas.size()) > body->NumShape()) {
    throw Error(
        "--betas",
        fmt::format("{} numbers, {} has {}", begin.betas.size(), body->Name(), body->NumShape()),
        "Give fewer");
  }
  Eigen::VectorXd betas = Eigen::VectorXd::Zero(body->NumShape());
  std::ranges::copy(begin.betas, betas.begin());
  const StandingHoldOptions options{begin.left, begin.in_hand, common.seed, NumThreads(common)};
  StandingHold hold = MakeStandingHold({body, betas}, object, action, options);
  if (hold.status == StandingHoldStatus::kNoGrasp) {
    throw FitFailure(fmt::format("{}: {}. Try another size (--object-scale)", begin.object,
                                 Describe(hold.grasp)));
  }
  if (hold.status == StandingHoldStatus::kNobodyCan) {
    throw FitFailure(
        fmt::format("{}: nobody can hold it so as to '{}': {} ({}). Try another "
                    "--seed, --betas or --object-scale",
                    begin.object, action, hold.fault, hold.detail));
  }
  return {std::move(hold.start),
          {{"made", true}, {"hand", begin.left ? "left" : "right"}, {"betas", begin.betas}}};
}

nlohmann::json SynthesisJson(const SynthesizeJob& job, const imos::Intent& intent,
                             const SynthesisNetwork& network, const SynthesisStart& start,
                             const SynthesizeOptions& options, const SynthesizedMotion& made) {
  nlohmann::json faults = nlohmann::json::array();
  for (const SynthesizedSample& sample : made.samples) {
    faults.push_back({{"sample", sample.number}, {"faults", sample.faults}});
  }
  return {{"action", made.motion.action},
          {"object", imos::Objects()[intent.object]},
          {"sentence", imos::SentenceOf(intent)},
          {"network", network.ToJson()},
          {"start", start.how},
          {"key_frames", job.key_frames},
          {"seconds_per_key_frame", options.seconds_per_key_frame},
          {"samples", faults},
          {"switch_key_frame", made.samples.front().keys.switch_frame},
          {"sigma", job.sigma},
          {"style", job.style},
          {"pace", made.samples.front().style.pace},
          {"and_back", job.and_back}};
}

FitCommand FitOf(const SynthesizeJob& job, const SynthesizedMotion& made) {
  FitCommand fit;
  fit.job.clip = made.motion.action;
  fit.job.object = job.begin.object;
  fit.motion = made.motion;
  fit.output = job.output;
  fit.body = job.begin.body;
  fit.write_report = job.write_report;
  CarryOptions& carry = fit.job.carry;
  carry.object_scale = job.begin.object_scale;
  carry.clear_passages = made.lets_go;
  carry.hand_over = made.switch_frame.has_value();
  if (carry.hand_over) {
    carry.handover.switch_frames = {*made.switch_frame};
    carry.handover.first_hand = made.first_hand;
  }
  return fit;
}

// Before the fit: the object is where the key frames have it.
void WriteSamples(const SynthesizeJob& job, const HoldingStart& start,
                  const SynthesizedMotion& made) {
  const std::filesystem::path folder = std::filesystem::path(job.output) / "samples";
  std::filesystem::create_directories(folder);
  for (std::size_t rank = 0; rank < made.samples.size(); ++rank) {
    const Clip& motion = made.samples[rank].motion;
    WriteClip(
        start.mirrored ? MirrorClip(motion, start.actor->Measures().rest_joints.col(0)) : motion,
        folder / fmt::format("{:02d}.npz", rank));
  }
}

}  // namespace

Outcome RunSynthesizeJob(SynthesizeJob job, const CommonOptions& common) {
  const SynthesisNetwork network = LoadSynthesisNetwork(job.weights, job.action_embeddings);
  WarnOfOldPelvis(job.weights, network.weights.notes, common);
  const imos::Intent intent = IntentOf(job, network);
  if (const std::string note = NoteOnIntent(network, intent); !note.empty()) Note(common, note);
  const LoadedObject object = LoadObject(job.begin.object, job.begin.object_scale);
  RequireHandheld(object);
  const SynthesisStart start =
      job.begin.from.empty() ? Made(job.begin, object, imos::Actions()[intent.action].label, common)
                             : FromClip(job.begin, object, common);
  if (Interrupted()) return {kInterrupted, {}, {}};
  SynthesizeOptions options;
  options.seconds_per_key_frame =
      job.seconds ? *job.seconds / (job.key_frames - 1) : network.SecondsPerKeyFrame(intent.action);
  options.key_frames = job.key_frames;
  options.samples = job.samples;
  options.sigma = job.sigma;
  options.style = job.style;
  options.keep_pace = job.seconds.has_value();
  options.finish_all = job.all;
  options.frame_rate = job.frame_rate;
  options.and_back = job.and_back;
  options.action_table = network.action_table;
  options.seed = common.seed;
  options.threads = NumThreads(common);
  const SynthesizedMotion made = Synthesize(start.held, network.weights, intent, options);
  if (Interrupted()) return {kInterrupted, {}, {}};

  FitCommand fit = FitOf(job, made);
  fit.extra["synthesis"] = SynthesisJson(job, intent, network, start, options, made);
  std::optional<FaceDistance> at_face;
  fit.measure = [&](const Clip& fitted, nlohmann::json& metrics) {
    at_face = NearestToFace(start.held, made.motion.action, fitted);
    if (!at_face) return;
    metrics["synthesis"]["at_face_mm"] = 1000.0 * at_face->distance_m;
    metrics["synthesis"]["at_face_frame"] = at_face->frame;
  };
  FitLibrary library;
  Outcome outcome = RunFitCommand(fit, common, library);
  if (outcome.summary.is_null()) return outcome;
  if (job.all) WriteSamples(job, start.held, made);
  if (at_face) {
    outcome.text = fmt::format("  at the face         {:.1f} mm from its place in frame {}\n{}",
                               1000.0 * at_face->distance_m, at_face->frame, outcome.text);
  }
  outcome.text = fmt::format(
      "{}\n  made                {:.1f} s of motion in {} key frames; best of {} samples, {:.0f} "
      "ms each with the object\n{}",
      imos::SentenceOf(intent), (made.motion.NumFrames() - 1) / made.motion.frame_rate,
      job.key_frames, job.samples, 1000.0 * made.loop_s / job.samples, outcome.text);
  return outcome;
}

}  // namespace holdfast::apps
