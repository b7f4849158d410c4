// SPDX-License-Identifier: MIT
#include "apps/motion/synthesize.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit_job.h"
#include "apps/motion/reach.h"
#include "generator/actions/action_catalog.h"
#include "generator/imos/synthesis_network.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "solver/actions/action_clip.h"
#include "solver/synthesis/synthesize.h"

namespace holdfast::apps {

void AddSynthesizeCommand(CLI::App& app, int& exit_code) {
  struct Options {
    CommonOptions common;
    SynthesizeCommand command;
  };
  auto options = std::make_shared<Options>();
  SynthesizeCommand& job = options->command;
  CLI::App* command = app.add_subcommand(
      "synthesize",
      "Generate a person who does something with an object: body and object motion from an intent");
  CLI::Option* sentence =
      command->add_option("sentence,--text", job.sentence,
                          "Sentence in place of --action: \"The person drinks from the mug\", "
                          "\"raise the cup and take a sip\". The nearest known action is used");
  CLI::Option* action =
      command->add_option("--action", job.action, "The action: " + ScriptedActionNames())
          ->excludes(sentence);
  CLI::Option* object =
      command->add_option("--object", job.object,
                          std::string(kObjectHelp) + "; default: the object named in the sentence");
  action->needs(object);
  command->add_option(
      "--class", job.job.object_class,
      "Class of the object for the networks: mug, waterbottle, ... [the object's name]");
  command->add_option("--from", job.from,
                      "CLIP or CLIP:FRAME to continue from, with the object in a hand. Without "
                      "--from, the person stands at the origin, facing -y");
  AddOptions(*command, OptionsOf(job.job).Without({"object_class"}));
  for (const char* made : {"--start", "--hand"}) {
    command->get_option(made)->excludes(command->get_option("--from"));
  }
  command
      ->add_option("--betas", job.betas,
                   "Shape coefficients of the body (only without --from): 1.5,-0.5")
      ->delimiter(',')
      ->excludes(command->get_option("--from"));
  command->add_flag("--all", job.all,
                    "Also write all samples, as they are before the object is fitted: "
                    "samples/NN.npz, best first");
  command->add_option("--body", job.body, "Body model in place of the embedded one");
  const bool embedded = imos::HasDefaultNetwork();
  command
      ->add_option("--weights", job.weights,
                   embedded ? "Networks (.safetensors) in place of the embedded ones"
                            : "Networks (.safetensors); this program was built without networks")
      ->required(!embedded);
  command->add_option("--action-vectors", job.action_vectors,
                      "File of text-encoder vectors (.npz, .safetensors): of the 29 actions, for "
                      "networks trained with such vectors, and of the sentence, to find the "
                      "nearest action");
  command->add_flag_callback(
      "--no-report", [&out = job.write_report] { out = false; }, "Leave out report.html");
  AddOption(*command, "-o,--output", job.output,
            "Output folder: clip.npz, object.ply, metrics.json, report.html");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast synthesize --action drink --object mug\n"
      "  holdfast synthesize \"The person takes picture with the camera\" --seed 7 -o picture\n"
      "  holdfast synthesize --action drink --object mug --start table -o drinks\n"
      "  holdfast synthesize --action pour --object jug.obj --class teapot --hand left -o poured\n"
      "  holdfast synthesize --action inspect --object held/object.ply --class mug --from held \\\n"
      "      -o inspected\n"
      "The best sample has the least penetration, the least collision of object and body, the "
      "least\n"
      "excess of joint angles over the captured range, and the most contact; in a tie, the first "
      "wins.\n");
  command->callback([options, &exit_code] {
    const SynthesizeCommand& asked = options->command;
    if (asked.sentence.empty() && asked.action.empty()) {
      throw CLI::RequiredError("A sentence, or --action and --object,");
    }
    const Outcome outcome = RunSynthesize(asked, options->common);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

namespace {

// Object class for the networks: as given, or from the object's name.
int ObjectClass(const SynthesizeCommand& job) {
  if (!job.job.object_class.empty()) {
    return imos::ObjectId(imos::VocabularyName(job.job.object_class), "--class");
  }
  const std::string named = std::filesystem::path(job.object).stem().string();
  if (const auto id = imos::FindObject(imos::VocabularyName(named))) return *id;
  LoadObject(job.object);  // a missing object is a different error than an unknown class
  return imos::ObjectId(named, "--class");
}

// Object class by --class or the name of --object, if known; else the sentence tells it.
std::optional<int> KnownClass(const SynthesizeCommand& job) {
  if (job.object.empty()) return std::nullopt;
  if (!job.job.object_class.empty()) return ObjectClass(job);
  const std::string named = std::filesystem::path(job.object).stem().string();
  return imos::FindObject(imos::VocabularyName(named));
}

// Action and object of a sentence. Prints how the action was found if it is not named.
imos::Intent IntentOfSentence(SynthesizeCommand& job, const std::vector<std::string>& names,
                              const CommonOptions& common) {
  const std::vector<std::string_view> actions(names.begin(), names.end());
  const std::vector<std::string> meshes = EmbeddedNames("objects", "_300.ply");
  std::vector<std::string_view> objects;
  for (const std::string& mesh : meshes) objects.push_back(imos::VocabularyName(mesh));
  std::optional<imos::NearestAction> nearest;
  if (!job.action_vectors.empty()) {
    nearest = imos::FindNearestAction(job.action_vectors, job.sentence, names);
    if (!nearest) {
      Note(common, fmt::format("note: {} has no vector of \"{}\": the action is found by its words",
                               job.action_vectors, job.sentence));
    }
  }
  const imos::ParsedSentence parsed =
      imos::ParseSentence(job.sentence, actions, objects,
                          nearest ? std::optional(nearest->action) : std::nullopt, KnownClass(job));
  const std::string_view label = imos::Actions()[parsed.action].label;
  if (nearest) {
    Note(common, fmt::format("note: \"{}\" is taken as '{}', the nearest vector (cosine {:.2f})",
                             job.sentence, label, nearest->cosine));
  } else if (!parsed.because.empty()) {
    Note(common,
         fmt::format("note: \"{}\" is taken as '{}' ({})", job.sentence, label, parsed.because));
  }
  if (job.object.empty()) job.object = imos::EmbeddedMeshName(imos::Objects()[parsed.object]);
  return parsed;
}

imos::Intent IntentOf(SynthesizeCommand& job, const SynthesisNetwork& network,
                      const CommonOptions& common) {
  const std::vector<std::string> names = OfferedActions(network, job.from.empty());
  const std::vector<std::string_view> actions(names.begin(), names.end());
  const bool sentence = !job.sentence.empty();
  const imos::Intent intent =
      sentence ? IntentOfSentence(job, names, common)
               : imos::Intent{imos::ActionId(job.action, "--action", actions), ObjectClass(job)};
  RequireOffered(intent, names, sentence ? fmt::format("\"{}\"", job.sentence) : "--action");
  return intent;
}

struct SynthesisStart {
  HoldingStart held;
  nlohmann::json how;  // for metrics.json
};

// Start from the person of the clip, with the motion up to the frame.
SynthesisStart FromClip(const SynthesizeCommand& command, const LoadedObject& object,
                        const CommonOptions& common) {
  const auto [name, frame] = ParseStart(command.from);
  ClipInputOptions options;
  options.body = command.body;
  options.object = command.object;
  options.object_scale = command.job.object_scale;
  const ClipInput input = LoadClipInput(name, options, common);
  SynthesisStart start;
  start.held =
      StartInClip(input.clip, {input.body, input.betas}, object, frame, NumThreads(common), name);
  start.how = {{"from", name}, {"frame", start.held.clip.NumFrames() - 1}};
  return start;
}

// Generated start: a standing person who holds the object.
SynthesisStart Made(const SynthesizeCommand& command, const LoadedObject& object,
                    std::string_view action) {
  const std::shared_ptr<const BodyModel> body = LoadBody(command.body);
  if (static_cast<int>(command.betas.size()) > body->NumShape()) {
    throw Error("--betas",
                fmt::format("has {} coefficients, but {} has {}", command.betas.size(),
                            body->Name(), body->NumShape()),
                "Give fewer coefficients");
  }
  Eigen::VectorXd betas = Eigen::VectorXd::Zero(body->NumShape());
  std::ranges::copy(command.betas, betas.begin());
  const StandingHoldOptions& standing = command.job.standing;
  SynthesisJob job = command.job;
  return {MakeStart({body, betas}, object, command.object, action, standing),
          {{"made", true},
           {"hand", OptionsJson(OptionsOf(job).Only({"hand"}))["hand"]},
           {"betas", command.betas}}};
}

nlohmann::json SynthesisJson(const SynthesisJob& job, const imos::Intent& intent,
                             const SynthesisNetwork& network, const SynthesisStart& start,
                             const SynthesizedMotion& made) {
  const SynthesizeOptions& options = job.options;
  nlohmann::json faults = nlohmann::json::array();
  for (const SynthesizedSample& sample : made.samples) {
    faults.push_back({{"sample", sample.number}, {"faults", sample.faults}});
  }
  return {{"action", made.motion.action},
          {"object", imos::Objects()[intent.object]},
          {"sentence", imos::SentenceOf(intent)},
          {"network", network.ToJson()},
          {"start", start.how},
          {"key_frames", options.key_frames},
          {"seconds_per_key_frame", options.seconds_per_key_frame},
          {"samples", faults},
          {"switch_key_frame", made.samples.front().keys.switch_frame},
          {"sigma", options.sigma},
          {"style", options.style},
          {"pace", made.samples.front().style.pace},
          {"and_back", options.and_back}};
}

// Writes the samples before the fit: the object is as in the key frames.
void WriteSamples(const std::string& output, const HoldingStart& start,
                  const SynthesizedMotion& made) {
  const std::filesystem::path folder = std::filesystem::path(output) / "samples";
  std::filesystem::create_directories(folder);
  for (std::size_t rank = 0; rank < made.samples.size(); ++rank) {
    const Clip& motion = made.samples[rank].motion;
    WriteClip(
        start.mirrored ? MirrorClip(motion, start.actor->Measures().rest_joints.col(0)) : motion,
        folder / fmt::format("{:02d}.npz", rank));
  }
}

}  // namespace

Outcome RunSynthesize(SynthesizeCommand command, const CommonOptions& common) {
  const SynthesisNetwork network = LoadSynthesisNetwork(command.weights, command.action_vectors);
  WarnOfOldPelvis(command.weights, network.weights.notes, common);
  const imos::Intent intent = IntentOf(command, network, common);
  if (const auto note = NoteOnIntent(network, intent)) Note(common, "note: " + *note);
  SynthesisJob& job = command.job;
  job.standing.seed = job.options.seed = common.seed;
  job.standing.threads = job.options.threads = NumThreads(common);
  job.options.finish_all = command.all;
  const LoadedObject object = LoadObject(command.object, job.object_scale);
  RequireHandheld(object);
  const SynthesisStart start = command.from.empty()
                                   ? Made(command, object, imos::Actions()[intent.action].label)
                                   : FromClip(command, object, common);
  if (Interrupted()) return {kInterrupted, {}, {}};
  const SynthesizedMotion made = Synthesize(job, start.held, network, intent);
  if (Interrupted()) return {kInterrupted, {}, {}};

  FitCommand fit;
  fit.job = FitOf(job, made, command.object);
  fit.motion = made.motion;
  fit.output = command.output;
  fit.body = command.body;
  fit.write_report = command.write_report;
  fit.extra["synthesis"] = SynthesisJson(job, intent, network, start, made);
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
  if (command.all) WriteSamples(command.output, start.held, made);
  if (at_face) {
    outcome.text = fmt::format("  at the face         {:.1f} mm from its target in frame {}\n{}",
                               1000.0 * at_face->distance_m, at_face->frame, outcome.text);
  }
  outcome.text = fmt::format(
      "{}\n"
      "  generated           {:.1f} s of motion in {} key frames; best of {} samples, {:.0f} ms "
      "per sample with the object\n"
      "{}",
      imos::SentenceOf(intent), (made.motion.NumFrames() - 1) / made.motion.frame_rate,
      job.options.key_frames, job.options.samples, 1000.0 * made.loop_s / job.options.samples,
      outcome.text);
  return outcome;
}

}  // namespace holdfast::apps
