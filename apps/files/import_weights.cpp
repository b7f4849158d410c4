// SPDX-License-Identifier: MIT
#include "generator/imos/weights.h"
#include "generator/wandr/network.h"

#include <fmt/format.h>

#include "apps/common.h"

namespace holdfast::apps {
namespace {

struct ImportWeightsCommand {
  CommonOptions common;
  std::string arms, body;  // WANDR: the checkpoint, none
  std::string statistics;
  std::string output;
  std::string actions;
  std::string arm_order = "published";
  std::string object_rotation = "rows";
  int heads = 4;
  bool half = false;
  bool keep_training = false;
};

long CountNumbers(const imos::NetworkWeights& weights) {
  long count = 0;
  for (const auto& [name, tensor] : weights.tensors) {
    count += static_cast<long>(tensor.values.size());
  }
  return count;
}

int RunWandr(const ImportWeightsCommand& options) {
  const wandr::ImportedNetwork imported = wandr::ImportNetwork(options.arms, options.statistics);
  wandr::WriteNetwork(imported.weights, options.output, options.half);
  nlohmann::json summary = JsonHead("holdfast/import-weights/1", options.common);
  summary["output"] = options.output;
  summary["latent_size"] = imported.weights.LatentSize();
  summary["has_encoder"] = imported.weights.encoder.has_value();
  summary["bytes"] = std::filesystem::file_size(options.output);
  summary["ignored"] = imported.ignored;
  PrintResult(options.common, summary,
              fmt::format("{}: network of WANDR, {} latents, {}: use it with 'reach --weights'\n",
                          options.output, imported.weights.LatentSize(),
                          imported.weights.encoder ? "with encoder" : "without encoder"));
  return kDone;
}

int Run(const ImportWeightsCommand& options) {
  const CommonOptions& common = options.common;
  RequireNew(options.output, common);
  if (options.body.empty()) return RunWandr(options);
  imos::ImportWeightsOptions import;
  import.arm_order = options.arm_order == "published" ? imos::ArmOrder::kRightThenLeft
                                                      : imos::ArmOrder::kAscending;
  import.object_rotation = options.object_rotation == "rows" ? imos::ObjectRotation::kRows
                                                             : imos::ObjectRotation::kColumns;
  import.attention_heads = options.heads;
  import.keep_training = options.keep_training;
  imos::ImportedWeights imported = imos::ImportWeights(options.arms, options.body, import);
  imos::NetworkWeights& weights = imported.weights;
  if (options.actions.empty()) {
    Note(common, fmt::format("note: without --actions no embeddings are stored; the networks need "
                             "an embedding of {} numbers for each action",
                             weights.config.action_size));
  } else {
    weights.tensors["action_embedding.weight"] =
        nn::MatrixTensor(imos::ReadActionTable(options.actions, weights.config.action_size));
  }
  weights.notes["source"] = "imported from PyTorch checkpoints of IMoS";
  imos::WriteNetwork(weights, options.output, options.half);

  nlohmann::json summary = JsonHead("holdfast/import-weights/1", common);
  summary["output"] = options.output;
  summary["config"] = imos::ConfigTexts(weights.config);
  summary["numbers"] = CountNumbers(weights);
  summary["bytes"] = std::filesystem::file_size(options.output);
  summary["has_action_table"] = weights.HasActionTable();
  summary["ignored"] = imported.ignored;
  const std::string text = fmt::format(
      "{}: {} numbers, {:.1f} MB{}\n  arms {} -> {} -> {}, z {}; body {} -> {} -> {}, z {}; "
      "actions of {} numbers{}\n",
      options.output, CountNumbers(weights),
      static_cast<double>(std::filesystem::file_size(options.output)) / 1e6,
      options.half ? " (matrices at half precision)" : "", weights.config.ArmsPastInput(),
      weights.config.arms_first, weights.config.arms_second, weights.config.arms_latent,
      weights.config.BodyPastInput(), weights.config.body_first, weights.config.body_second,
      weights.config.body_latent, weights.config.action_size,
      weights.HasActionTable() ? ", stored with the weights" : "");
  PrintResult(common, summary, text);
  return kDone;
}

}  // namespace

void AddImportWeightsCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ImportWeightsCommand>();
  CLI::App* command = app.add_subcommand(
      "import-weights",
      "Convert published checkpoints of IMoS or WANDR to Holdfast's weight format");
  command
      ->add_option("checkpoint", options->arms,
                   "IMoS: checkpoint of the arms' network (.p, .pt, .pth). WANDR: its checkpoint "
                   "(.ckpt)")
      ->required();
  CLI::Option* const body =
      command->add_option("body", options->body, "IMoS: checkpoint of the body's network");
  command
      ->add_option("--statistics", options->statistics,
                   "WANDR: feature statistics (.npy), given instead of the argument body")
      ->excludes(body);
  command->add_option("-o,--output", options->output, "Weights to write (.safetensors)")
      ->required();
  command->add_option("--actions", options->actions,
                      "Embeddings of the 29 actions (.npz, .safetensors, .pt) to store with the "
                      "weights: an array per label, or one called 'embeddings' (29 x E)");
  AddOption(*command, "--arm-order", options->arm_order,
            "Joint order of the arms: published (17,19,21,16,18,20: the released weights) or "
            "ascending (weights trained with the published code)",
            CLI::IsMember({"published", "ascending"}));
  AddOption(*command, "--object-rotation", options->object_rotation,
            "Convention of object rotations in training: points as rows (GRAB) or as columns",
            CLI::IsMember({"rows", "columns"}));
  AddOption(*command, "--heads", options->heads, "Number of self-attention heads",
            CLI::Range(1, 1024));
  command->add_flag("--half", options->half, "Store matrices at half precision");
  command->add_flag("--keep-training", options->keep_training,
                    "Keep the encoder of the present frame, which is used only in training");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast import-weights exp_80_001600.p exp_31_001500.p -o imos.safetensors "
      "--actions clip_embeddings.npz\n"
      "  holdfast import-weights wandr.ckpt --statistics statistics.npy -o wandr.safetensors\n"
      "  holdfast import-weights arms.p body.p -o mine.safetensors --arm-order ascending --half\n");
  for (const char* const of_imos :
       {"--actions", "--arm-order", "--object-rotation", "--heads", "--keep-training"}) {
    command->get_option("--statistics")->excludes(command->get_option(of_imos));
  }
  command->callback([options, &exit_code] {
    if (options->body.empty() && options->statistics.empty()) {
      throw CLI::RequiredError("body (of IMoS) or --statistics (of WANDR)");
    }
    exit_code = Run(*options);
  });
}

}  // namespace holdfast::apps
