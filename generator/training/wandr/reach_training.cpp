// SPDX-License-Identifier: MIT
#include "generator/training/wandr/reach_training.h"

#include <fmt/format.h>

#include "generator/wandr/reach_protocol.h"

namespace holdfast::wandr {
namespace {

using nlohmann::json;

json Evaluate(const Trainer& trainer, const Corpus* held_out, const BodyMeasures& body) {
  const NetworkWeights weights = trainer.Weights(false);
  const Network<float> network(weights);
  const Normalizer<double> norms(weights.statistics);
  const auto starts = AsFloat(ComposedStarts(body, norms));
  ReachProtocol protocol = ReachProtocol::Adaptive();
  protocol.num_samples = 1;
  protocol.seed = 2;
  protocol.intention.wrist = trainer.Options().intention.wrist;
  const auto outcomes = RunReachProtocol(network, BoneOffsetsOf(body.rest_joints).Cast<float>(),
                                         starts, protocol, {.threads = trainer.Options().threads});
  const ReachSummary summary = Summarize(outcomes);
  json line{{"success", summary.success},
            {"distance_m", summary.distance_mean_m},
            {"distance_median_m", summary.distance_median_m},
            {"skating", summary.skating},
            {"airborne", summary.airborne},
            {"acceleration", summary.acceleration_m_s2}};
  if (held_out) line["held_out"] = JsonOf(trainer.Validate(*held_out));
  return line;
}

}  // namespace

Training ReachTraining(Trainer& trainer, const Corpus& corpus, const Corpus* held_out,
                       const BodyMeasures& body) {
  Training training{trainer, trainer.Options().iterations, "reach", {}, {}, {}, {}};
  training.step = [&](json& losses, json& line) {
    const TrainingLosses now = trainer.Step();
    losses = JsonOf(now);
    line["kind"] = now.free ? "free" : "train";
  };
  training.evaluate = [&trainer, held_out, &body] { return Evaluate(trainer, held_out, body); };
  training.is_better = [](const json& now, const json& best) {
    return now["success"] >= best["success"];
  };
  training.write = [&](const TrainingNotes& notes, const std::string& stem) {
    NetworkWeights weights = trainer.Weights(true);
    weights.notes.insert(notes.begin(), notes.end());
    weights.notes["corpus"] =
        fmt::format("{:.2f} h captured (mirror images counted), {:.2f} h made",
                    static_cast<double>(corpus.captured_frames) / 108000.0,
                    static_cast<double>(corpus.made_frames) / 108000.0);
    WriteNetwork(weights, stem + ".safetensors");
    WriteNetwork(weights, stem + "_half.safetensors", true);
  };
  return training;
}

}  // namespace holdfast::wandr
