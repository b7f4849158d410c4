// SPDX-License-Identifier: MIT
#include "apps/synthesize_job.h"

#include <algorithm>
#include <chrono>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/synthesis_network.h"
#include "generator/actions/action_catalog.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/actions/action_clip.h"
#include "solver/actions/action_measures.h"
#include "solver/synthesis/synthesis.h"
#include "solver/synthesis/synthesis_motion.h"

namespace holdfast::apps {
namespace {

// How little is wrong with a sample: sums of what the measures find, each in units of what a made
// clip may have at most.
double FaultsOf(const ActionQuality& quality) {
  const auto share = [](double value, double most) { return std::max(0.0, value / most - 0.5); };
  return share(quality.penetrating, 0.02) + share(1.0 - quality.contact, 0.02) +
         share(quality.object_in_body_mm, 5.0) + share(quality.hand_in_head_mm, 6.0) +
         share(quality.arm_in_trunk_mm, 25.0) + share(quality.beyond_limits, 0.03) +
         share(quality.skate, 0.1);
}

struct Sample {
  Synthesised made;
  Clip motion;  // at the frame rate asked for
  double faults = 0.0;
  int number = 0;
};

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
  LoadObjectInput(
      job.begin.object);  // no such file or object is another fault than one of no class
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

}  // namespace

FitOutcome RunSynthesizeJob(SynthesizeJob job, const CommonOptions& common) {
  const SynthesisNetwork network = LoadSynthesisNetwork(job.weights, job.action_embeddings);
  const imos::Intent intent = IntentOf(job, network);
  if (const std::string note = NoteOnIntent(network, intent); !note.empty()) Note(common, note);
  const HeldStart start = BeginSynthesis(job.begin, intent, common);
  if (Interrupted()) return {kInterrupted, {}, {}};

  const imos::Network<float> networks(network.weights);
  const HandModel* const hands[] = {&start.actor->Hand(Side::kRight),
                                    &start.actor->Hand(Side::kLeft)};
  const double seconds =
      job.seconds ? *job.seconds / (job.key_frames - 1) : network.SecondsPerKeyFrame(intent.action);
  const SynthesisScene scene{start.clip,     start.actor->Measures().rest_joints,
                             hands,          start.prop->fit,
                             intent,         seconds,
                             job.key_frames, imos::Actions()[intent.action].label == "offhand"};
  const auto began = std::chrono::steady_clock::now();
  std::vector<Synthesised> made =
      Synthesise(networks, network.action_table, scene, FitOptions(), job.samples, common.seed, 0,
                 job.sigma, NumThreads(common));
  const double loop_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  std::vector<Sample> samples(made.size());
  ParallelFor(static_cast<int>(samples.size()), NumThreads(common), [&](int i) {
    Sample& sample = samples[i];
    sample.made = std::move(made[i]);
    sample.number = i;
    sample.motion = MotionOfKeyFrames(sample.made.clip, start.actor->Measures(), job.frame_rate);
    ActionQuality quality;
    MeasureAction(*start.actor, *start.prop, sample.motion, quality);
    sample.faults = FaultsOf(quality);
  });
  std::ranges::stable_sort(samples, {}, &Sample::faults);
  if (Interrupted()) return {kInterrupted, {}, {}};

  FitJob fit;
  const Sample& best = samples.front();
  const std::string action(imos::Actions()[intent.action].label);
  fit.clip = action;
  fit.motion = start.mirrored ? MirrorClip(best.motion) : best.motion;
  fit.motion->action = action;
  fit.object = job.begin.object;
  fit.object_scale = job.begin.object_scale;
  fit.output = job.output;
  fit.body = job.begin.body;
  fit.write_report = job.write_report;
  fit.offhand = best.made.switch_frame >= 0;
  if (fit.offhand) {
    fit.handover.switch_frames = {
        static_cast<int>(std::lround((best.made.switch_frame - 0.5) * seconds * job.frame_rate))};
    fit.handover.first_hand = start.mirrored ? Side::kLeft : Side::kRight;
  }
  nlohmann::json faults = nlohmann::json::array();
  for (const Sample& sample : samples) {
    faults.push_back({{"sample", sample.number}, {"faults", sample.faults}});
  }
  fit.extra["synthesis"] = {{"action", action},
                            {"object", imos::Objects()[intent.object]},
                            {"sentence", imos::SentenceOf(intent)},
                            {"network", network.ToJson()},
                            {"start", start.how},
                            {"key_frames", job.key_frames},
                            {"seconds_per_key_frame", seconds},
                            {"samples", faults},
                            {"switch_key_frame", best.made.switch_frame},
                            {"sigma", job.sigma}};
  FitLibrary library;
  FitOutcome outcome = RunFitJob(fit, common, library);
  if (outcome.summary.is_null()) return outcome;
  outcome.text = fmt::format(
      "{}\n  made                {:.1f} s of motion in {} key frames; best of {} samples, {:.0f} "
      "ms each with the object\n{}",
      imos::SentenceOf(intent), seconds * (job.key_frames - 1), job.key_frames, job.samples,
      1000.0 * loop_s / job.samples, outcome.text);
  return outcome;
}

}  // namespace holdfast::apps
