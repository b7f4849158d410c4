// SPDX-License-Identifier: MIT
#include "solver/evaluation/marker_study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <random>

#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kCarriedRate = 30.0;  // Hz, of clips with a cup

// [0, 1), the same everywhere.
double Uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1.0p-53; }
int Below(std::mt19937_64& random, int count) { return static_cast<int>(Uniform(random) * count); }

void Hide(MarkerRecording& recording, int marker, int begin, int end) {
  recording.positions.block(3 * marker, begin, 3, end - begin)
      .setConstant(std::numeric_limits<double>::quiet_NaN());
}

// Adds what a solve says of the marker in frames where it was measured.
void AddErrors(const MarkerRecording& measured, const SolvedRecording& solved,
               const std::string& name, int begin, int end, MarkerErrors& errors) {
  const auto at = std::ranges::find_if(solved.report.markers,
                                       [&](const auto& m) { return m.site.name == name; });
  const int marker = measured.Find(name).value_or(-1);
  if (at == solved.report.markers.end() || marker < 0) return;
  const Eigen::Index row = 3 * (at - solved.report.markers.begin());
  for (int t = begin; t < end; ++t) {
    if (!measured.Seen(marker, t)) continue;
    errors.square_sum_mm2 += 1e6 * (measured.At(marker, t) * solved.report.world.scale -
                                    solved.carried.block<3, 1>(row, t) * solved.report.world.scale)
                                       .squaredNorm();
    ++errors.count;
  }
}

class TrialStudy {
 public:
  TrialStudy(const MarkerTrial& trial, int index, const std::shared_ptr<const BodyModel>& model,
             const MarkerStudyOptions& options)
      : trial_(trial),
        index_(index),
        model_(model),
        options_(options),
        random_(options.seed * 1'000'003u + static_cast<std::uint64_t>(index)) {}

  MarkerTrialResult Run() {
    MarkerTrialResult result;
    result.name = trial_.name;
    result.frames = trial_.recording.NumFrames();
    result.rate_hz = trial_.recording.rate_hz;
    const double begin = CoreSeconds();
    const SolvedRecording plain = Solve(trial_.recording);
    result.core_s = CoreSeconds() - begin;
    result.worst_marker = plain.report.worst_marker;
    result.worst_rms_mm = plain.report.worst_rms_mm;
    for (const SolvedMarker& marker : plain.report.markers) {
      if (marker.seen == 0) continue;
      seen_.push_back(marker.site.name);
      AddErrors(trial_.recording, plain, marker.site.name, 0, result.frames, result.residual);
    }
    if (options_.object) {
      result.touches = StudyTouches(trial_.recording, plain, model_, *options_.object, 1);
    }
    result.head = plain.report.head;
    if (options_.cup) Drink(plain.clip, result);
    LeaveOut(result);
    CutGaps(result);
    AddFaults(plain, result);
    return result;
  }

 private:
  SolvedRecording Solve(const MarkerRecording& recording) const {
    return SolveMarkers(recording, trial_.still.get(), model_, options_.solve, trial_.name);
  }
  int Marker(int k) const { return *trial_.recording.Find(seen_[static_cast<std::size_t>(k)]); }

  void Drink(const Clip& clip, MarkerTrialResult& result) const {
    const ClipBody body{model_, clip.betas};
    const BodySurface surface(model_, clip.betas);
    if (!FindDrink(TrackPalms(clip, surface.RestJoints()), FindFaceMarks(surface))) return;
    CarryOptions carry;
    carry.drink = true;
    carry.seed = options_.seed;
    const CarryReport carried =
        CarryObject(Resample(clip, kCarriedRate), body, *options_.cup, carry);
    result.drink = carried.drink;
    if (!carried.drunk) return;
    result.drunk = *carried.drunk;
    result.in_hand_mm = carried.contact.penetration_mean_max_mm;
    result.in_body_frames = carried.clearance.deep;
  }

  void LeaveOut(MarkerTrialResult& result) const {
    const int n = static_cast<int>(seen_.size());
    for (int k = 0; k < std::min(options_.left_out, n); ++k) {
      const int out = (index_ * options_.left_out + k) % n;
      MarkerRecording recording = trial_.recording;
      Hide(recording, Marker(out), 0, recording.NumFrames());
      MarkerTrialResult::LeftOut left{.marker = seen_[static_cast<std::size_t>(out)], .errors = {}};
      AddErrors(trial_.recording, Solve(recording), left.marker, 0, recording.NumFrames(),
                left.errors);
      if (left.errors.count > 0) result.left_out.push_back(std::move(left));
    }
  }

  void CutGaps(MarkerTrialResult& result) {
    const int length = static_cast<int>(std::lround(options_.gap_s * trial_.recording.rate_hz));
    if (length < 1) return;
    MarkerRecording recording = trial_.recording;
    std::vector<std::pair<int, int>> gaps;  // marker of seen_, first frame
    for (int at = length / 2; at + length < recording.NumFrames(); at += 2 * length) {
      gaps.emplace_back(Below(random_, static_cast<int>(seen_.size())), at);
      Hide(recording, Marker(gaps.back().first), at, at + length);
    }
    if (gaps.empty()) return;
    const SolvedRecording solved = Solve(recording);
    for (const auto& [k, at] : gaps) {
      AddErrors(trial_.recording, solved, seen_[static_cast<std::size_t>(k)], at, at + length,
                result.gap);
    }
  }

  void AddFaults(const SolvedRecording& plain, MarkerTrialResult& result) {
    MarkerRecording recording = trial_.recording;
    const int n = static_cast<int>(seen_.size()), frames = recording.NumFrames();
    if (n < 2 || options_.outlier_share <= 0.0) return;
    const int a = Below(random_, n), b = (a + 1 + Below(random_, n - 1)) % n;
    const int length =
        std::min(frames, static_cast<int>(std::lround(options_.swap_s * recording.rate_hz)));
    const int from = Below(random_, frames - length + 1);
    const Eigen::MatrixXd kept = recording.positions.block(3 * Marker(a), from, 3, length);
    recording.positions.block(3 * Marker(a), from, 3, length) =
        trial_.recording.positions.block(3 * Marker(b), from, 3, length);
    recording.positions.block(3 * Marker(b), from, 3, length) = kept;
    for (int t = 0; t < frames; ++t) {
      for (int k = 0; k < n; ++k) {
        if (Uniform(random_) >= options_.outlier_share) continue;
        Eigen::Vector3d off(Uniform(random_) - 0.5, Uniform(random_) - 0.5, Uniform(random_) - 0.5);
        off *= (0.05 + 0.15 * Uniform(random_)) / std::max(off.norm(), 1e-6);
        recording.positions.block<3, 1>(3 * Marker(k), t) += off;
      }
    }
    const SolvedRecording solved = Solve(recording);
    const Eigen::MatrixXd change = solved.carried - plain.carried;
    const Eigen::Map<const Eigen::Matrix3Xd> points(change.data(), 3, change.size() / 3);
    result.change = {.square_sum_mm2 = 1e6 * points.squaredNorm(),
                     .count = static_cast<int>(points.cols())};
    result.change_max_mm = 1e3 * points.colwise().norm().maxCoeff();
  }

  const MarkerTrial& trial_;
  int index_;
  std::shared_ptr<const BodyModel> model_;
  const MarkerStudyOptions& options_;
  std::mt19937_64 random_;
  std::vector<std::string> seen_;
};

}  // namespace

double MarkerErrors::Rms_mm() const { return count > 0 ? std::sqrt(square_sum_mm2 / count) : 0.0; }

MarkerErrors& MarkerErrors::operator+=(const MarkerErrors& other) {
  square_sum_mm2 += other.square_sum_mm2;
  count += other.count;
  return *this;
}

MarkerStudySums SumsOf(const std::vector<MarkerTrialResult>& results) {
  MarkerStudySums sums;
  // The place of the result that has most of something.
  const auto most = [&](std::optional<std::size_t>& place, std::size_t k, const auto& value) {
    if (!place || value(results[k]) > value(results[*place])) place = k;
  };
  for (std::size_t k = 0; k < results.size(); ++k) {
    const MarkerTrialResult& result = results[k];
    if (!result.fault.empty()) continue;
    ++sums.solved;
    sums.residual += result.residual;
    sums.gap += result.gap;
    sums.change += result.change;
    for (const auto& left : result.left_out) {
      sums.left_out += left.errors;
      sums.of_left_out[left.marker] += left.errors;
    }
    sums.seconds += result.frames / result.rate_hz;
    sums.core_s += result.core_s;
    most(sums.worst, k, [](const MarkerTrialResult& r) { return r.residual.Rms_mm(); });
    most(sums.worst_change, k, [](const MarkerTrialResult& r) { return r.change.Rms_mm(); });
    most(sums.slowest, k, [](const MarkerTrialResult& r) { return -r.Speed(); });
  }
  return sums;
}

std::vector<MarkerTrialResult> StudyMarkers(const std::vector<MarkerTrial>& trials,
                                            std::shared_ptr<const BodyModel> model,
                                            const MarkerStudyOptions& options,
                                            const std::function<bool(int, int)>& progress) {
  std::vector<MarkerTrialResult> results(trials.size());
  std::mutex lock;
  int done = 0;
  const int total = static_cast<int>(trials.size());
  ParallelFor(total, options.threads, [&](int k) {
    MarkerTrialResult& result = results[static_cast<std::size_t>(k)];
    try {
      result = TrialStudy(trials[static_cast<std::size_t>(k)], k, model, options).Run();
    } catch (const Error& error) {
      result.name = trials[static_cast<std::size_t>(k)].name;
      result.fault = error.what();
    }
    const std::scoped_lock guard(lock);
    if (progress && !progress(++done, total)) throw WorkStopped();
  });
  return results;
}

DrinkSums DrinksOf(const std::vector<MarkerTrialResult>& results) {
  constexpr double kAtMouth_mm = 20.0;
  DrinkSums sums;
  for (std::size_t k = 0; k < results.size(); ++k) {
    const MarkerTrialResult& result = results[k];
    if (!result.drink) continue;
    const double off_mm = 1e3 * result.drunk.rim_from_mouth_m;
    ++sums.trials;
    sums.at_mouth += off_mm < kAtMouth_mm;
    sums.mean_mm += off_mm;
    if (off_mm >= sums.worst_mm) sums.worst = k;
    sums.worst_mm = std::max(sums.worst_mm, off_mm);
    sums.lean_deg = std::max(sums.lean_deg, result.drunk.lean_rad / kDegree);
    sums.wrist_mm = std::max(sums.wrist_mm, 1e3 * result.drink->wrist_shift_m);
    sums.in_hand_mm = std::max(sums.in_hand_mm, result.in_hand_mm);
    sums.no_clean_grasp += result.drink->status != GraspStatus::kFound;
    sums.in_body_frames += result.in_body_frames;
  }
  if (sums.trials > 0) sums.mean_mm /= sums.trials;
  return sums;
}

HeadSums HeadsOf(const std::vector<MarkerTrialResult>& results) {
  HeadSums sums;
  for (const MarkerTrialResult& result : results) {
    sums.frames += result.frames;
    sums.deep_before += result.head.deep_before;
    sums.deep += result.head.deep;
    sums.worst_before_mm = std::max(sums.worst_before_mm, 1e3 * result.head.worst_before_m);
    sums.worst_mm = std::max(sums.worst_mm, 1e3 * result.head.worst_m);
  }
  return sums;
}

}  // namespace holdfast
