// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "generator/imos/recognition.h"
#include "solver/evaluation/synthesis/synthesis_results.h"

namespace holdfast {

struct SynthesisStudyOptions {
  int repeats = 20;        ///< of each case, with given and carried objects
  int fitted_repeats = 1;  ///< with fitted ones, which take a second each
  /// Hand and object are measured in so many of the first repeat's cases, evenly spread: it takes a
  /// second each.
  int object_cases = 60;
  double sigma = 1.0;       ///< of the latents
  bool keep_clips = false;  ///< the clips of the first repeat, 30 frames a second, in clips/
  std::uint64_t seed = 1;
  int threads = 1;     ///< the result does not depend on them
  bool force = false;  ///< blocks of another configuration are replaced
};

/// IMoS's Table 2 (Ghosh et al. 2023) by the authors' definitions and the field's, with measures of
/// hand and object. Samples are made and measured in blocks that are kept in files: a stopped study
/// is resumed.
///
///   std::vector<RatedNetwork> networks;
///   networks.emplace_back("full", LoadSynthesisNetwork());
///   SynthesisStudy study("out", cases, recognizer, checksum, {});
///   const auto results = study.Run(SynthesisRows(networks, std::array{ObjectMode::kGiven}));
class SynthesisStudy {
 public:
  /// `cases` and `recognizer` must outlive it. `folder` is made. `stopped` is asked often, on any
  /// thread.
  SynthesisStudy(
      std::filesystem::path folder, std::span<const SynthesisCase> cases,
      const imos::Recognizer& recognizer, const std::string& recognizer_checksum,
      const SynthesisStudyOptions& options, std::function<bool()> stopped = [] { return false; });

  /// Motions of all rows, and how many of them are still to be made. Throws Error as Run does.
  struct Motions {
    int total = 0, left = 0;
  };
  Motions Count(std::span<const SynthesisRow> rows) const;
  /// Each row with what came of it, the first RowKind::kReal, then means over seeds
  /// (AddMeansOverSeeds); empty when stopped, complete blocks stay. `progress` sees how many
  /// motions this call has made. Throws Error for blocks of another configuration unless `force`,
  /// and for damaged ones, naming the file.
  std::vector<SynthesisResult> Run(
      std::span<const SynthesisRow> rows,
      const std::function<void(int made)>& progress = [](int) {});

 private:
  int Repeats(const SynthesisRow& row) const;
  /// Cases of this repeat that are there already.
  int NumDone(const SynthesisRow& row, int repeat) const;
  /// All cases; nothing when stopped. `progress` sees how many more there are now.
  std::optional<SynthesisSample> RunRepeat(const SynthesisRow& row, int repeat,
                                           const std::function<void(int)>& progress);
  /// Whether hand and object of case `index` are measured.
  bool MeasuresObject(int repeat, int index) const;
  int BlockSize(const SynthesisRow& row, int repeat) const;
  std::filesystem::path BlockFile(const SynthesisRow& row, int repeat, int first) const;
  std::string Question(const SynthesisRow& row, int repeat) const;
  std::optional<SynthesisSample> Load(const SynthesisRow& row, int repeat, int first,
                                      int count) const;
  void Save(const SynthesisSample& sample, const SynthesisRow& row, int repeat, int first) const;
  SynthesisSample Make(const SynthesisRow& row, int repeat, int first, int count);
  std::vector<SynthesizedCase> MakeCases(const SynthesisRow& row, int repeat, int first, int count);
  Eigen::VectorXd MeasureObject(const SynthesisRow& row, const SynthesisCase& one,
                                const SynthesizedCase& made) const;

  std::filesystem::path folder_;
  std::span<const SynthesisCase> cases_;
  const imos::Recognizer& recognizer_;
  std::string asked_;  // checksum of cases and recognizer
  SynthesisStudyOptions options_;
  std::function<bool()> stopped_;
  FitLibrary library_{64};
};

}  // namespace holdfast
