// SPDX-License-Identifier: MIT
#include "solver/evaluation/reach_method_study.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "generator/wandr/motion_states.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

constexpr int kBlockOfMotions = 64;    // motions in a file
constexpr int kMotionsPerThread = 16;  // between writings of it: what shares a pass over weights

// Decimals that are worth a file's room: a micrometer, a tenth of a millisecond.
std::vector<double> Rounded(const std::vector<float>& values, double per_unit) {
  std::vector<double> rounded;
  for (const float value : values) {
    rounded.push_back(std::round(static_cast<double>(value) * per_unit) / per_unit);
  }
  return rounded;
}

nlohmann::json JsonOf(const MethodMotion& motion) {
  nlohmann::json solves = nlohmann::json::array();
  for (const LatentSolve& solve : motion.solves) {
    solves.push_back({solve.minimizer, solve.linear_solver, solve.iterations, solve.termination});
  }
  return {{"outcome", StudyRow(motion.motion)},
          {"fast_ratio", motion.fast_share},
          {"latent_rms", motion.latent_rms},
          {"seconds", motion.seconds},
          {"closest_m", motion.closest_m},
          {"seconds_at", motion.seconds_at},
          {"solves", solves}};
}

MethodMotion MotionOf(const nlohmann::json& out) {
  MethodMotion motion;
  motion.motion = StudyMotionOf(out.at("outcome"));
  motion.fast_share = out.at("fast_ratio");
  motion.latent_rms = out.at("latent_rms");
  motion.seconds = out.at("seconds");
  motion.closest_m = out.at("closest_m").get<std::vector<double>>();
  motion.seconds_at = out.at("seconds_at").get<std::vector<double>>();
  for (const nlohmann::json& solve : out.at("solves")) {
    motion.solves.push_back({solve.at(0), solve.at(1), solve.at(2), solve.at(3)});
  }
  if (motion.closest_m.size() != motion.seconds_at.size()) {
    throw nlohmann::json::other_error::create(501, "iterates differ in number", nullptr);
  }
  return motion;
}

std::string ChecksumOf(const MethodStudy::Question& question) {
  return ReachQuestion{question.starts, question.method.protocol,
                       question.method.key + " " + question.method.settings, false,
                       &question.network}
      .Checksum();
}

}  // namespace

MethodSummary SummarizeMethod(std::span<const MethodMotion> motions) {
  std::vector<StudyMotion> plain;
  MethodSummary summary;
  for (const MethodMotion& motion : motions) {
    const wandr::ReachOutcome& outcome = motion.motion.outcome;
    plain.push_back(motion.motion);
    summary.airborne_motions += outcome.airborne_share > 0.0;
    summary.fast_motions += motion.fast_share > 0.0;
    summary.fast_frames += motion.fast_share;
    summary.latent_rms += motion.latent_rms;
    summary.seconds += motion.seconds;
    for (const LatentSolve& solve : motion.solves) {
      const std::string with = solve.linear_solver.empty() ? "" : ", " + solve.linear_solver;
      auto& [count, iterations] = summary.solves[solve.minimizer + with + ": " + solve.termination];
      ++count;
      iterations += solve.iterations;
    }
    summary.success_any +=
        outcome.Reached() || std::ranges::any_of(motion.closest_m, [](double distance) {
          return distance <= wandr::kReachedWithin;
        });
  }
  summary.study = SummarizeMotions(plain);
  const auto count = static_cast<double>(motions.size());
  for (double* const mean : {&summary.airborne_motions, &summary.fast_motions, &summary.fast_frames,
                             &summary.latent_rms, &summary.seconds, &summary.success_any}) {
    *mean /= count;
  }
  return summary;
}

double FastShare(const Eigen::Ref<const Eigen::MatrixXf>& joints) {
  int fast = 0, pairs = 0;
  for (Eigen::Index f = 0; f + 1 < joints.cols() && joints.col(f + 1).allFinite(); ++f) {
    const Eigen::Vector3d way =
        (joints.block<3, 1>(0, f + 1) - joints.block<3, 1>(0, f)).cast<double>();
    fast += way.norm() * wandr::kFramesPerSecond > kFastPelvis;
    ++pairs;
  }
  return static_cast<double>(fast) / std::max(pairs, 1);
}

std::vector<int> SpreadCases(const wandr::ReachProtocol& protocol, int num_starts) {
  const std::array sizes = {num_starts, protocol.num_angles, protocol.num_heights,
                            protocol.num_distances, protocol.num_samples};
  constexpr double kRoot = 1.1347241384015194;
  const int total = protocol.NumCases(num_starts);
  std::vector<bool> met(total, false);
  std::vector<int> order;
  for (int k = 0; static_cast<int>(order.size()) < total; ++k) {
    int index = 0;
    double step = 1.0;
    for (const int size : sizes) {
      step /= kRoot;
      double whole = 0.0;
      const double place = std::modf(0.5 + k * step, &whole);
      index = index * size + std::min(static_cast<int>(place * size), size - 1);
    }
    if (met[index]) continue;
    met[index] = true;
    order.push_back(index);
  }
  return order;
}

MethodStudy::MethodStudy(std::filesystem::path folder, const wandr::LowestPoint& lowest,
                         const wandr::BoneOffsets<float>& bones, bool replace, int threads)
    : blocks_(std::move(folder), replace), lowest_(lowest), bones_(bones), threads_(threads) {}

std::vector<MethodMotion> MethodStudy::Load(const ReachMethod& method, int block,
                                            const std::string& checksum) const {
  std::vector<MethodMotion> motions;
  blocks_.Read("method_" + method.key, block, checksum, [&](const nlohmann::json& rows) {
    for (const nlohmann::json& row : rows) motions.push_back(MotionOf(row));
    return motions.size() <= kBlockOfMotions;
  });
  return motions;
}

int MethodStudy::NumDone(const Question& question) const {
  const int total = static_cast<int>(question.cases.size());
  const std::string checksum = ChecksumOf(question);
  int done = 0;
  for (int first = 0; first < total; first += kBlockOfMotions) {
    const auto there = Load(question.method, first / kBlockOfMotions, checksum).size();
    done += std::min(static_cast<int>(there), total - first);
  }
  return done;
}

MethodMotion MethodStudy::Measure(const ReachTask& task, const ReachSolution& solution) const {
  MethodMotion measured;
  measured.motion.outcome = wandr::MeasureReach(solution.track.joints, task.goal);
  measured.motion.surface_skating = wandr::SkatingOfLowestVertex(lowest_, solution.track.states);
  measured.fast_share = FastShare(solution.track.joints);
  const auto numbers = static_cast<double>(std::max<Eigen::Index>(solution.latents.size(), 1));
  measured.latent_rms = solution.latents.norm() / std::sqrt(numbers);
  measured.closest_m = Rounded(solution.trace.closest_m, 1e6);
  measured.seconds_at = Rounded(solution.trace.seconds, 1e4);
  measured.solves = solution.solves;
  return measured;
}

std::vector<MethodMotion> MethodStudy::Run(const Question& question,
                                           const std::function<void(int)>& progress,
                                           const std::function<void()>& poll) const {
  const wandr::ReachProtocol& protocol = question.method.protocol;
  const std::vector<wandr::RolloutStart<float>> starts = wandr::AsFloat(question.starts);
  const std::vector<wandr::ReachCase> cases = wandr::ReachCases(protocol, bones_, starts);
  const std::string checksum = ChecksumOf(question);
  const int total = static_cast<int>(question.cases.size()), threads = threads_;
  std::vector<MethodMotion> all;
  for (int first = 0; first < total; first += kBlockOfMotions) {
    const int count = std::min(kBlockOfMotions, total - first);
    std::vector<MethodMotion> block = Load(question.method, first / kBlockOfMotions, checksum);
    while (static_cast<int>(block.size()) < count) {
      poll();
      const int begin = static_cast<int>(block.size());
      const int size = std::min(count - begin, kMotionsPerThread * threads);
      std::vector<ReachTask> tasks(size);
      for (int k = 0; k < size; ++k) {
        const int index = question.cases[first + begin + k];
        const wandr::ReachCase& one = cases[index];
        tasks[k] = {starts[one.start], one.goal,      protocol.num_frames - 1,
                    one.deadline,      protocol.seed, static_cast<std::uint64_t>(index)};
      }
      const auto started = std::chrono::steady_clock::now();
      const std::vector<ReachSolution> solutions = question.method.solve(tasks, threads, poll);
      const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - started;
      block.resize(begin + size);
      ParallelFor(size, threads, [&](int k) {
        MethodMotion& motion = block[begin + k];
        motion = Measure(tasks[k], solutions[k]);
        motion.seconds = motion.seconds_at.empty() ? passed.count() * std::min(threads, size) / size
                                                   : motion.seconds_at.back();
      });
      nlohmann::json out = {{"motions", nlohmann::json::array()}};
      for (const MethodMotion& motion : block) out["motions"].push_back(JsonOf(motion));
      blocks_.Write("method_" + question.method.key, first / kBlockOfMotions, checksum,
                    std::move(out));
      progress(size);
    }
    all.insert(all.end(), block.begin(), block.begin() + count);
  }
  return all;
}

}  // namespace holdfast
