// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "generator/imos/synthesis_metrics.h"
#include "solver/evaluation/synthesis/synthesis_rows.h"

namespace holdfast {

/// What is measured of body and object together, in clips of 30 frames a second: MetricDefinitions
/// of `score`, by their keys.
std::span<const char* const> SynthesisObjectKeys();

/// One repeat of one row, over the N cases in their order.
struct SynthesisSample {
  Eigen::MatrixXf features;     ///< (128 x N)
  std::vector<int> recognized;  ///< N
  /// (4 x N) MPJPE in m, AVE of the code, AVE in m^2, and FaceError in m, NaN where there is none
  Eigen::Matrix4Xd errors;
  Eigen::Matrix2Xd seconds;  ///< (2 x N) of key frames with object; of fitting all frames
  Eigen::MatrixXd objects;   ///< (keys x N) NaN where undefined or not measured; no rows in repeats

  void Append(const SynthesisSample& more);
  int Count() const { return static_cast<int>(recognized.size()); }
};

/// Share of sequences of one action that are recognized, mean over repeats.
struct ActionAccuracy {
  std::string action;
  int sequences = 0;
  double accuracy = 0.0;
};

/// Over all repeats of a row. Errors and distances are of held-out sequences; docs/metrics.md has
/// the definitions. `_code`: as the authors' code computes it.
struct SynthesisSummary {
  int sequences = 0;
  std::optional<imos::RepeatedValue> mpjpe_m, ave_code, ave_m2, fid_code, fid, face_m;
  imos::RepeatedValue accuracy, diversity_code, diversity, multimodality_code;
  std::optional<imos::RepeatedValue> multimodality;
  std::vector<ActionAccuracy> by_action;
  /// Of the first repeat: means over sequences, medians for ratios of jitter, which have no mean to
  /// speak of; nothing where undefined for all. By SynthesisObjectKeys.
  std::map<std::string, std::optional<double>> objects;
  double seconds = 0.0, finishing_seconds = 0.0;  ///< medians over sequences; 0: not timed
};

/// A row with what came of it.
struct SynthesisResult {
  SynthesisRow row;
  SynthesisSummary summary;
};

/// Real motion's "FID" is that of two random halves of it: what sets of that size are apart by
/// chance. Other rows stand against `real`. What does not vary is not repeated but for random
/// draws of pairs, of which there are `repeats`.
SynthesisSummary SummarizeSynthesis(const SynthesisRow& row,
                                    std::span<const SynthesisSample> samples,
                                    const SynthesisSample& real,
                                    std::span<const SynthesisCase> cases, int repeats,
                                    std::uint64_t seed);

/// Adds a row for every name that has several networks (NAME, NAME@2, ...) with one mode: the means
/// of their means, with 95 % intervals of the seeds of their trainings.
void AddMeansOverSeeds(std::vector<SynthesisResult>& results);

nlohmann::json SynthesisJson(const SynthesisResult& result);
nlohmann::json PaperSynthesisJson();

/// Whether the full model is better than every ablation by a measure of the table: means over seeds
/// where there are any, else single networks. Empty without both. Sentences for people.
std::vector<std::string> OrderOfRows(std::span<const SynthesisResult> results, ObjectMode mode);

}  // namespace holdfast
