// SPDX-License-Identifier: MIT
#include "solver/evaluation/synthesis/synthesis_rows.h"

#include <array>

#include <fmt/format.h>

namespace holdfast {
namespace {

constexpr std::pair<const char*, const char*> kNames[] = {
    {"full", "full model"},
    {"random-embeddings", "ablation 1: random action vectors"},
    {"no-attention", "ablation 2: no self-attention"},
    {"one-module", "ablation 3: one network for the whole body"}};

// Six means, each with its interval.
PaperSynthesisRow RowOf(const char* key, const char* label, const std::array<double, 12>& of) {
  const auto value = [&](int k) { return PaperValue{of[2 * k], of[2 * k + 1]}; };
  return {key, label, value(0), value(1), value(2), value(3), value(4), value(5)};
}

}  // namespace

std::span<const PaperSynthesisRow> PaperSynthesisRows() {
  static const PaperSynthesisRow rows[] = {
      {"real", "real motion", {}, {}, {}, {0.97, 0.001}, {1.15, 0.015}, {0.30, 0.010}},
      RowOf("", "ACTOR",
            {0.09, 0.005, 8.05, 0.002, 0.67, 0.002, 0.78, 0.010, 1.06, 0.015, 0.19, 0.010}),
      RowOf("", "Action2Motion",
            {0.11, 0.003, 8.26, 0.002, 1.08, 0.002, 0.69, 0.011, 1.10, 0.010, 0.22, 0.010}),
      RowOf("", "TEMOS",
            {0.10, 0.005, 9.98, 0.001, 1.21, 0.004, 0.23, 0.010, 0.83, 0.010, 0.09, 0.010}),
      RowOf("random-embeddings", "1: random action vectors",
            {0.05, 0.002, 4.41, 0.002, 0.39, 0.002, 0.78, 0.012, 1.06, 0.015, 0.21, 0.010}),
      RowOf("no-attention", "2: no self-attention",
            {0.04, 0.005, 4.77, 0.002, 0.38, 0.002, 0.82, 0.010, 1.10, 0.020, 0.24, 0.020}),
      RowOf("one-module", "3: one net, whole body",
            {0.05, 0.005, 5.41, 0.002, 0.42, 0.002, 0.82, 0.010, 1.08, 0.010, 0.25, 0.010}),
      RowOf("full", "IMoS",
            {0.03, 0.005, 3.82, 0.004, 0.27, 0.002, 0.87, 0.011, 1.11, 0.015, 0.28, 0.015}),
  };
  return rows;
}

std::string LabelOfNetwork(const std::string& name) {
  const std::size_t at = name.find('@');
  if (at != std::string::npos) {
    return fmt::format("{}, seed {}", LabelOfNetwork(name.substr(0, at)), name.substr(at + 1));
  }
  for (const auto& [known, label] : kNames) {
    if (name == known) return label;
  }
  return name;
}

std::vector<SynthesisRow> SynthesisRows(std::span<const RatedNetwork> networks,
                                        std::span<const ObjectMode> modes) {
  std::vector<SynthesisRow> rows = {{"real", "real motion", RowKind::kReal},
                                    {"clip", "real motion, all frames", RowKind::kClip},
                                    {"still", "last given pose, held", RowKind::kStill}};
  for (const ObjectMode mode : modes) {
    for (const RatedNetwork& network : networks) {
      rows.push_back(
          {network.name, LabelOfNetwork(network.name), RowKind::kNetwork, mode, &network});
    }
  }
  return rows;
}

}  // namespace holdfast
