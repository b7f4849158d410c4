// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "generator/actions/action_catalog.h"
#include "generator/imos/config.h"
#include "geometry/error.h"
#include "solver/synthesis/synthesize.h"

namespace holdfast {

OptionTable OptionsOf(SynthesisJob& job) {
  SynthesizeOptions& options = job.options;
  OptionTable table;
  table.Text("object_class", job.object_class,
             "Class of the object for the networks: mug, waterbottle, ...; empty: its name");
  table.Number("object_scale", "", job.object_scale, kPositive,
               "Multiplies the object's coordinates (0.001 for millimetres)");
  table.Choice<std::optional<bool>>(
      "start", job.standing.in_hand, {{"any", std::nullopt}, {"table", false}, {"hand", true}},
      "Where the object is at a generated start: on a table, in the hand, any");
  table.Choice("hand", job.standing.left, {{"right", false}, {"left", true}},
               "Hand that holds at a generated start");
  table.Number("seconds", "", job.seconds, {0.5, 60.0}, "the usual one of the action",
               "Duration of the motion");
  table.Number("key_frames", "", options.key_frames, {imos::kHistory + 1, 1000},
               "Number of key frames, 4 of them given");
  table.Number("samples", "", options.samples, {1, 10'000}, "Motions to choose from");
  table.Number("sigma", "", options.sigma, {0.0, 3.0},
               "Standard deviation of the latents; 0: the mean motion");
  table.Number("style", "", options.style, {0.0, 2.0},
               "How much samples differ in pace and posture; 0: by their latents alone. The first "
               "sample has none");
  table.Number("frame_rate", "", options.frame_rate, {5.0, 240.0}, "Frame rate of the output, Hz");
  table.Flag("and_back", options.and_back,
             "Put the object back where it was; on a table the hand lets go of it");
  return table;
}

std::vector<std::string> OfferedActions(const SynthesisNetwork& network, bool makes_start) {
  std::vector<std::string> offered = network.Actions();
  std::erase_if(offered, [&](const std::string& action) {
    return makes_start &&
           std::ranges::find(MadeActions(), action, &MadeAction::name) == MadeActions().end();
  });
  return offered;
}

void RequireOffered(const imos::Intent& intent, const std::vector<std::string>& offered,
                    const std::string& where) {
  const std::string_view label = imos::Actions()[intent.action].label;
  if (std::ranges::find(offered, label) != offered.end()) return;
  throw Error(where, fmt::format("no motion can be generated for '{}'", label),
              fmt::format("There are: {}", fmt::join(offered, ", ")));
}

std::optional<std::string> NoteOnIntent(const SynthesisNetwork& network,
                                        const imos::Intent& intent) {
  const std::string object(imos::Objects()[intent.object]);
  const auto seen = network.seen.find(std::string(imos::Actions()[intent.action].label));
  if (seen == network.seen.end() || !seen->second.is_object() || seen->second.contains(object)) {
    return std::nullopt;
  }
  std::vector<std::string> objects;
  for (const auto& [name, count] : seen->second.items()) objects.push_back(name);
  return fmt::format("nobody was seen who {} a {}; seen with {}",
                     imos::Actions()[intent.action].verb, object, fmt::join(objects, ", "));
}

HoldingStart MakeStart(const ClipBody& body, const LoadedObject& object, const std::string& name,
                       std::string_view action, const StandingHoldOptions& options) {
  StandingHold hold = MakeStandingHold(body, object, action, options);
  if (hold.status == StandingHoldStatus::kNoGrasp) {
    throw FitFailure(fmt::format("{}: {}. Try another size (--object-scale)", name,
                                 Describe(hold.grasp)));
  }
  if (hold.status == StandingHoldStatus::kNobodyCan) {
    throw FitFailure(
        fmt::format("{}: nobody can hold it so as to '{}': {} ({}). Try another --seed, --betas or "
                    "--object-scale",
                    name, action, hold.fault, hold.detail));
  }
  return std::move(hold.start);
}

SynthesizedMotion Synthesize(SynthesisJob& job, const HoldingStart& start,
                             const SynthesisNetwork& network, const imos::Intent& intent,
                             const StagedProgress& progress) {
  SynthesizeOptions& options = job.options;
  options.seconds_per_key_frame = job.seconds ? *job.seconds / (options.key_frames - 1)
                                              : network.SecondsPerKeyFrame(intent.action);
  options.keep_pace = job.seconds.has_value();
  options.action_table = network.action_table;
  return Synthesize(start, network.weights, intent, options, progress);
}

FitJob FitOf(const SynthesisJob& job, const SynthesizedMotion& made, const std::string& object) {
  FitJob fit;
  fit.clip = made.motion.action;
  fit.object = object;
  CarryOptions& carry = fit.carry;
  carry.object_scale = job.object_scale;
  carry.clear_passages = made.lets_go;
  carry.hand_over = made.switch_frame.has_value();
  if (carry.hand_over) {
    carry.handover.switch_frames = {*made.switch_frame};
    carry.handover.first_hand = made.first_hand;
  }
  carry.seed = job.options.seed;
  carry.threads = job.options.threads;
  return fit;
}

}  // namespace holdfast
