// SPDX-License-Identifier: MIT
#include "apps/evaluate/reach_study_methods_results.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace holdfast::apps {
namespace {

// Captured clips, all or those that walk, as motions without a goal.
std::vector<MethodMotion> AsMotions(const std::vector<CapturedMotion>& captured, bool walking) {
  std::vector<MethodMotion> motions;
  for (const CapturedMotion& one : captured) {
    if (walking && !one.walks) continue;
    MethodMotion motion;
    motion.motion = one.motion;
    motion.fast_share = one.fast_share;
    motions.push_back(motion);
  }
  return motions;
}

nlohmann::json MannerJson(const MethodSummary& s) {
  return {{"motions", s.study.reach.count},
          {"foot_skating_ratio", s.study.surface_skating},
          {"foot_skating_joints_ratio", s.study.reach.skating},
          {"airborne_motions_ratio", s.airborne_motions},
          {"airborne_frames_ratio", s.study.reach.airborne},
          {"pelvis_over_2_m_s_motions_ratio", s.fast_motions},
          {"pelvis_over_2_m_s_frames_ratio", s.fast_frames},
          {"peak_pelvis_median_m_s", s.study.reach.peak_pelvis_median_m_s},
          {"acceleration_mean_m_s2", s.study.reach.acceleration_m_s2}};
}

}  // namespace

std::span<const PaperRow> PaperRows() {
  // Table 2 of the paper; its supplement, with the details of the first, is not public.
  static constexpr PaperRow kRows[] = {{"paper: VAE + opt", 0.03, 0.04, 2.170},
                                       {"paper: WANDR", 0.32, 0.16, 0.248}};
  return kRows;
}

std::vector<CapturedGroup> GroupsOf(const std::vector<CapturedMotion>& captured) {
  std::vector<CapturedGroup> groups;
  for (const bool walking : {false, true}) {
    const std::vector<MethodMotion> motions = AsMotions(captured, walking);
    if (motions.empty()) continue;
    groups.push_back({walking ? "walking" : "all",
                      walking
                          ? fmt::format("captured, the {} that go a meter or more", motions.size())
                          : fmt::format("captured, {} held-out clips", motions.size()),
                      SummarizeMethod(motions)});
  }
  return groups;
}

SuccessCurve SuccessByIteration(const MethodRun& run) {
  std::size_t longest = 1;
  for (const MethodMotion& motion : run.motions) {
    longest = std::max(longest, motion.closest_m.size());
  }
  SuccessCurve curve;
  for (std::size_t k = 0; k < longest; ++k) {
    double reached = 0.0;
    for (const MethodMotion& motion : run.motions) {
      const std::size_t last = motion.closest_m.size();
      reached += last == 0 ? motion.motion.outcome.Reached()
                           : motion.closest_m[std::min(k, last - 1)] <= wandr::kReachedWithin;
    }
    curve.x.push_back(static_cast<double>(k));
    curve.success.push_back(reached / static_cast<double>(run.motions.size()));
  }
  return curve;
}

SuccessCurve SuccessBySeconds(const MethodRun& run) {
  constexpr int kPoints = 60;
  double first = run.summary.seconds, last = run.summary.seconds;
  bool iterates = false;
  for (const MethodMotion& motion : run.motions) {
    if (motion.seconds_at.empty()) continue;
    iterates = true;
    first = std::min(first, motion.seconds_at.front());
    last = std::max(last, motion.seconds_at.back());
  }
  first = std::max(first, 1e-4);
  last = std::max(last, first * 1.001);
  SuccessCurve curve;
  for (int k = 0; k < (iterates ? kPoints : 1); ++k) {
    const double at = first * std::pow(last / first, static_cast<double>(k) / (kPoints - 1));
    double reached = 0.0;
    for (const MethodMotion& motion : run.motions) {
      const auto done = std::ranges::upper_bound(motion.seconds_at, at * (1.0 + 1e-9)) -
                        motion.seconds_at.begin();
      if (motion.seconds_at.empty()) {
        reached += motion.motion.outcome.Reached();
      } else if (done > 0) {
        reached += motion.closest_m[done - 1] <= wandr::kReachedWithin;
      }
    }
    curve.x.push_back(at);
    curve.success.push_back(reached / static_cast<double>(run.motions.size()));
  }
  return curve;
}

nlohmann::json MethodsJson(const std::vector<MethodRun>& runs,
                           const std::vector<CapturedMotion>& captured) {
  nlohmann::json out;
  for (const PaperRow& paper : PaperRows()) {
    out["paper"].push_back({{"label", paper.label},
                            {"success_ratio", paper.success},
                            {"foot_skating_ratio", paper.skating},
                            {"distance_to_goal_mean_m", paper.distance_m}});
  }
  for (const CapturedGroup& group : GroupsOf(captured)) {
    out["captured"][group.key] = MannerJson(group.summary);
  }
  for (const MethodRun& run : runs) {
    const MethodSummary& s = run.summary;
    nlohmann::json one = {{"method", run.method.key},
                          {"label", run.method.label},
                          {"settings", run.method.settings},
                          {"summary", MannerJson(s)}};
    one["summary"].update({{"success_ratio", s.study.reach.success},
                           {"success_at_end_ratio", s.study.reach.success_at_end},
                           {"rests_ratio", s.study.reach.rests},
                           {"success_at_any_iterate_ratio", s.success_any},
                           {"distance_to_goal_mean_m", s.study.reach.distance_mean_m},
                           {"distance_to_goal_median_m", s.study.reach.distance_median_m},
                           {"latent_rms_mean", s.latent_rms},
                           {"seconds_mean", s.seconds},
                           {"diverged", s.study.reach.diverged}});
    for (const auto& [how, count] : s.solves) {
      one["solves"].push_back(
          {{"solver", how},
           {"count", count.first},
           {"iterations_mean", static_cast<double>(count.second) / count.first}});
    }
    const SuccessCurve iterations = SuccessByIteration(run), seconds = SuccessBySeconds(run);
    one["success_by_iteration"] = iterations.success;
    one["success_by_seconds"] = {{"seconds", seconds.x}, {"success_ratio", seconds.success}};
    one.update(PlacesJson(run.plain, true));
    out["methods"].push_back(std::move(one));
  }
  return out;
}

}  // namespace holdfast::apps
