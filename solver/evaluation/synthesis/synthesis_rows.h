// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "solver/evaluation/synthesis/synthesis_case.h"

namespace holdfast {

/// A mean with half its 95 % interval, as the paper prints it.
struct PaperValue {
  double mean, interval;
};

/// A row of IMoS's Table 2 (Ghosh et al. 2023), on GRAB.
struct PaperSynthesisRow {
  const char* key;  ///< of our row that stands beside it; empty for other methods
  const char* label;
  std::optional<PaperValue> mpjpe, ave, fid;  ///< none for real motion
  PaperValue accuracy, diversity, multimodality;
};
std::span<const PaperSynthesisRow> PaperSynthesisRows();

/// What stands in a row of our tables.
enum class RowKind {
  kReal,     ///< the held-out key frames themselves
  kClip,     ///< the clips that they are of, all frames: for the object alone
  kStill,    ///< the seed's last key frame, held
  kNetwork,  ///< what networks make of the seed
  kMean,     ///< several networks of one name that differ in the seed of their training
};

struct SynthesisRow {
  std::string key;    ///< "full", "no-attention", ...; names files
  std::string label;  ///< for people
  RowKind kind = RowKind::kReal;
  ObjectMode mode = ObjectMode::kGiven;
  const RatedNetwork* network = nullptr;

  bool HasMotionErrors() const { return kind == RowKind::kStill || kind == RowKind::kNetwork; }
  /// `key` without the seed of the training: "full" of "full@2".
  std::string Name() const { return key.substr(0, key.find('@')); }
  bool IsRandom() const { return kind == RowKind::kNetwork; }
};

/// Names of networks that have a row in the paper, and what they mean: full, random-embeddings,
/// no-attention, one-module; with "@2", that one trained from seed 2.
std::string LabelOfNetwork(const std::string& name);

/// All rows: real motion, its clips, held still, then every network with every mode.
std::vector<SynthesisRow> SynthesisRows(std::span<const RatedNetwork> networks,
                                        std::span<const ObjectMode> modes);

}  // namespace holdfast
