// SPDX-License-Identifier: MIT
#include "apps/reach_network.h"

#include "generator/wandr/reach_network.h"

namespace holdfast::apps {
namespace {

const char* LayoutName(wandr::IntentionLayout layout) {
  switch (layout) {
    case wandr::IntentionLayout::kPaper:
      return "paper";
    case wandr::IntentionLayout::kFlagged:
      return "flagged";
    case wandr::IntentionLayout::kBounded:
      return "bounded";
  }
  return "";
}

}  // namespace

ReachNetwork LoadReachNetwork(const std::string& path, const CommonOptions& common) {
  ReachNetwork network = holdfast::LoadReachNetwork(path);
  WarnOfOldPelvis(path, network.weights.notes, common);
  return network;
}

nlohmann::json NetworkJson(const ReachNetwork& network) {
  return {{"weights", network.source},
          {"checksum", network.checksum},
          {"intention", LayoutName(network.weights.layout)},
          {"notes", network.weights.notes}};
}

void AddWeightsOption(CLI::App& command, std::string& path) {
  const bool embedded = wandr::HasDefaultNetwork();
  command
      .add_option("--weights", path,
                  embedded ? "Network (.safetensors) in place of the embedded one"
                           : "Network (.safetensors); this program was built without one")
      ->required(!embedded);
}

}  // namespace holdfast::apps
