// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "solver/evaluation/reach_study.h"
#include "solver/latent/latent_options.h"

namespace holdfast {

inline constexpr double kFastPelvis = 2.0;  ///< m/s: nobody walks to a goal like that

/// A way to make the protocol's motions.
struct ReachMethod {
  std::string key;       ///< "intention", "vae-opt-adam", ...
  std::string label;     ///< for people
  std::string settings;  ///< all else that its motions depend on, as a text
  wandr::ReachProtocol protocol;
  /// Solutions in the order of the tasks; `poll` is called now and then, and may throw.
  std::function<std::vector<ReachSolution>(std::span<const ReachTask> tasks, int threads,
                                           const std::function<void()>& poll)>
      solve;
};

/// A motion of the protocol as a method made it.
struct MethodMotion {
  StudyMotion motion;
  double fast_share = 0.0;  ///< of pairs of frames, pelvis above kFastPelvis
  double latent_rms = 0.0;  ///< 1 for a sample
  double seconds = 0.0;     ///< of one core
  /// Iterates, the first before any step; empty for methods that do not iterate.
  std::vector<double> closest_m, seconds_at;
  std::vector<LatentSolve> solves;
};

/// Over many of them.
struct MethodSummary {
  StudySummary study;
  double airborne_motions = 0.0;  ///< share with both feet above 12 cm in any frame
  double fast_motions = 0.0;      ///< share with the pelvis above kFastPelvis in any
  double fast_frames = 0.0;
  double latent_rms = 0.0;   ///< mean
  double seconds = 0.0;      ///< mean
  double success_any = 0.0;  ///< share that was within 10 cm at any iterate
  /// "minimizer, linear solver: termination" of all solves, how often, with how many iterations.
  std::map<std::string, std::pair<int, int>> solves;
};
MethodSummary SummarizeMethod(std::span<const MethodMotion> motions);

/// Share of pairs of frames in which the pelvis is above kFastPelvis; `joints` (66 x F).
double FastShare(const Eigen::Ref<const Eigen::MatrixXf>& joints);

/// All cases of a protocol (indices into ReachCases) in an order whose first N, for any N, lie
/// evenly on every axis of its grid: cells of the lattice frac(1/2 + k a), a the powers of the root
/// of x^6 = x + 1 (Roberts 2018), each cell when it is first met.
std::vector<int> SpreadCases(const wandr::ReachProtocol& protocol, int num_starts);

/// Runs methods on the first cases of that order, keeping what is done in files: a stopped study
/// is resumed, and one of more cases extends one of fewer.
class MethodStudy {
 public:
  /// As ReachStudy.
  MethodStudy(std::filesystem::path folder, const wandr::LowestPoint& lowest,
              const wandr::BoneOffsets<float>& bones, bool replace, int threads);

  /// What is asked: `cases` of those of `method.protocol`, from `starts`, through `network`.
  struct Question {
    const ReachMethod& method;
    const std::vector<wandr::ReachStart>& starts;
    const ReachNetwork& network;
    std::span<const int> cases;
  };
  int NumDone(const Question& question) const;
  /// In the order of the cases. `progress` sees how many more are done, `poll` is called often;
  /// what they throw ends the run.
  std::vector<MethodMotion> Run(const Question& question, const std::function<void(int)>& progress,
                                const std::function<void()>& poll) const;

 private:
  std::vector<MethodMotion> Load(const ReachMethod& method, int block,
                                 const std::string& checksum) const;
  MethodMotion Measure(const ReachTask& task, const ReachSolution& solution) const;

  StudyBlocks blocks_;
  const wandr::LowestPoint& lowest_;
  const wandr::BoneOffsets<float>& bones_;
  int threads_;
};

}  // namespace holdfast
