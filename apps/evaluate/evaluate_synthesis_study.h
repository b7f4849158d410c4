// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/common.h"
#include "apps/evaluate/evaluate_synthesis_rows.h"
#include "generator/imos/recognition.h"
#include "solver/score/metric_values.h"

namespace holdfast::apps {

/// What is measured of body and object together, in clips of 30 frames a second: MetricDefinitions
/// of `score`, by their keys.
std::span<const char* const> SynthesisObjectKeys();
/// Thresholds as `score` has them, without the volumes.
ScoreOptions SynthesisScoreOptions();

/// One repeat of one row, over the N cases in their order.
struct SynthesisSample {
  Eigen::MatrixXf features;     ///< (128 x N)
  std::vector<int> recognised;  ///< N
  /// (4 x N) MPJPE in m, AVE of the code, AVE in m^2, and FaceError in m, NaN where there is none
  Eigen::Matrix4Xd errors;
  Eigen::Matrix2Xd seconds;  ///< (2 x N) of key frames with object; of fitting all frames
  Eigen::MatrixXd objects;   ///< (keys x N) NaN where undefined or not measured; no rows in repeats

  void Append(const SynthesisSample& more);
  int Count() const { return static_cast<int>(recognised.size()); }
};

struct SynthesisStudyOptions {
  double sigma = 1.0;
  /// Hand and object are measured in so many of the first repeat's cases, evenly spread: it takes a
  /// second each.
  int object_cases = 60;
  bool keep_clips = false;  ///< the clips of the first repeat, 30 frames a second, in clips/
};

/// Makes and measures samples in blocks that are kept in files: a stopped study goes on where it
/// was.
class SynthesisStudy {
 public:
  /// Everything given must outlive it. `folder` is made.
  SynthesisStudy(std::filesystem::path folder, std::span<const SynthesisCase> cases,
                 const imos::Recogniser& recogniser, const std::string& recogniser_checksum,
                 const SynthesisStudyOptions& options, const CommonOptions& common);

  /// Cases of this repeat that are there already.
  int NumDone(const SynthesisRow& row, int repeat) const;
  /// All cases. `progress` sees how many more there are now, and may throw: complete blocks stay.
  /// Throws Error for blocks of another question unless --force was given.
  SynthesisSample Run(const SynthesisRow& row, int repeat,
                      const std::function<void(int)>& progress);

 private:
  /// Whether hand and object of case `index` are measured.
  bool MeasuresObject(int repeat, int index) const;
  int BlockSize(const SynthesisRow& row, int repeat) const;
  std::filesystem::path BlockFile(const SynthesisRow& row, int repeat, int first) const;
  std::string Question(const SynthesisRow& row, int repeat) const;
  std::optional<SynthesisSample> Load(const SynthesisRow& row, int repeat, int first,
                                      int count) const;
  void Save(const SynthesisSample& sample, const SynthesisRow& row, int repeat, int first) const;
  SynthesisSample Make(const SynthesisRow& row, int repeat, int first, int count);
  std::vector<SynthesisedCase> MakeCases(const SynthesisRow& row, int repeat, int first, int count);
  Eigen::VectorXd MeasureObject(const SynthesisRow& row, const SynthesisCase& one,
                                const SynthesisedCase& made) const;

  std::filesystem::path folder_;
  std::span<const SynthesisCase> cases_;
  const imos::Recogniser& recogniser_;
  std::string asked_;  // checksum of cases and recogniser
  SynthesisStudyOptions options_;
  CommonOptions common_;
  FitLibrary library_{64};
};

}  // namespace holdfast::apps
