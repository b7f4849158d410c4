// SPDX-License-Identifier: MIT
#include "solver/evaluation/touch_study.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/carry/refine.h"

namespace holdfast {
namespace {

constexpr double kTouchGap_s = 0.2;

using Intervals = std::vector<std::pair<int, int>>;

// Frames in which `near` holds, those less than `gap` apart together.
template <typename Near>
Intervals IntervalsOf(int frames, int gap, const Near& near) {
  Intervals intervals;
  for (int t = 0; t < frames; ++t) {
    if (!near(t)) continue;
    if (intervals.empty() || t - intervals.back().second > gap) intervals.emplace_back(t, t);
    intervals.back().second = t + 1;
  }
  return intervals;
}

int NumMet(const Intervals& some, const Intervals& others) {
  return static_cast<int>(std::ranges::count_if(some, [&](const auto& a) {
    return std::ranges::any_of(
        others, [&](const auto& b) { return a.first < b.second && b.first < a.second; });
  }));
}

// From the nearest fingertip's marker to the object, meters, per frame; infinite where none is
// seen.
std::vector<double> FromFingertips(const MarkerRecording& recording, const SolvedRecording& solved,
                                   const SignedDistance& object) {
  const MarkerRecording in_world = InWorld(recording, solved.report.world, solved.report.lift_m);
  std::vector<int> tips;
  for (const SolvedMarker& marker : solved.report.markers) {
    const std::optional<int> column = recording.Find(marker.site.name);
    if (marker.site.joint >= kLeftHandBegin && marker.site.toward < 0 && column) {
      tips.push_back(*column);
    }
  }
  std::vector<double> nearest(static_cast<std::size_t>(recording.NumFrames()),
                              std::numeric_limits<double>::infinity());
  for (int t = 0; t < recording.NumFrames(); ++t) {
    const Eigen::Isometry3d object_from_world = solved.clip.object->Pose(t).inverse();
    for (const int tip : tips) {
      if (!recording.Seen(tip, t)) continue;
      nearest[t] = std::min(nearest[t], object.Distance(object_from_world * in_world.At(tip, t)));
    }
  }
  return nearest;
}

Intervals SkinTouches(const ContactScore& score, int gap) {
  return IntervalsOf(static_cast<int>(score.frames.size()), gap, [&](int t) {
    return score.frames[static_cast<std::size_t>(t)].min_distance_mm < 1e3 * kSkinTouch_m;
  });
}

}  // namespace

TouchStudy StudyTouches(const MarkerRecording& recording, const SolvedRecording& solved,
                        std::shared_ptr<const BodyModel> model, const PreparedObject& object,
                        int threads, const StagedProgress& progress) {
  TouchStudy study;
  study.frames = recording.NumFrames();
  const int gap = static_cast<int>(std::lround(kTouchGap_s * recording.rate_hz));
  const std::vector<double> nearest = FromFingertips(recording, solved, object.solid.distance);
  study.touches =
      IntervalsOf(study.frames, gap, [&](int t) { return nearest[t] < kMarkerTouch_m; });
  RefineOptions options;
  options.threads = threads;
  RefineReport refined;
  try {
    refined = RefineCarried(solved.clip, {std::move(model), solved.clip.betas}, object, options,
                            progress);
  } catch (const Error&) {
    return study;  // no hand gets to it
  }
  if (refined.status == RefineStatus::kStopped) throw WorkStopped();
  const Intervals before = SkinTouches(refined.before.contact, gap),
                  after = SkinTouches(refined.after.contact, gap);
  study.found = NumMet(study.touches, before);
  study.kept = NumMet(study.touches, after);
  study.more = static_cast<int>(before.size()) - NumMet(before, study.touches);
  study.deep_solved = refined.before.contact.deep_frames;
  study.deep_refined = refined.after.contact.deep_frames;
  study.deepest_solved_mm = refined.before.contact.penetration_max_mm;
  study.deepest_refined_mm = refined.after.contact.penetration_max_mm;
  return study;
}

}  // namespace holdfast
