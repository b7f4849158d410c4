// SPDX-License-Identifier: MIT
#include "apps/fit_metrics.h"

#include <algorithm>

#include <fmt/format.h>

#include "solver/clip_state.h"

namespace holdfast::apps {
namespace {

template <typename Frame, typename Get>
nlohmann::json PerFrame(const std::vector<Frame>& frames, const Get& get) {
  nlohmann::json values = nlohmann::json::array();
  for (const Frame& frame : frames) values.push_back(get(frame));
  return values;
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::vector<ContactMetrics> OfHoldingHands(const std::vector<std::vector<ContactMetrics>>& per_hand,
                                           const std::vector<const HandModel*>& hands,
                                           const std::vector<std::uint8_t>& holding) {
  std::vector<ContactMetrics> frames(per_hand.front().size());
  for (std::size_t t = 0; t < frames.size(); ++t) {
    ContactMetrics& all = frames[t];
    int counted = 0;
    for (std::size_t h = 0; h < hands.size(); ++h) {
      const std::uint8_t bit = HoldingBit(hands[h]->HandSide());
      if (holding[t] != 0 && (holding[t] & bit) == 0) continue;
      const ContactMetrics& one = per_hand[h][t];
      const bool first = counted++ == 0;
      all.max_penetration_mm = std::max(all.max_penetration_mm, one.max_penetration_mm);
      all.mean_penetration_mm = std::max(all.mean_penetration_mm, one.mean_penetration_mm);
      all.penetrating_ratio += one.penetrating_ratio;
      all.contact_ratio += one.contact_ratio;
      all.in_contact = (first || all.in_contact) && one.in_contact;
      all.min_distance_mm =
          first ? one.min_distance_mm : std::min(all.min_distance_mm, one.min_distance_mm);
      all.intersection_volume_cm3 += one.intersection_volume_cm3;
    }
    if (counted > 1) {
      all.penetrating_ratio /= counted;
      all.contact_ratio /= counted;
    }
  }
  return frames;
}

FitSummary SummarizeFit(const FitResult& result, const std::vector<ContactMetrics>& contact) {
  FitSummary summary;
  summary.frames = static_cast<int>(result.frames.size());
  summary.contact_pairs = result.num_contact_pairs;
  std::vector<double> solve_ms, iterations;
  for (const FrameReport& frame : result.frames) {
    if (frame.stop == StopReason::kGiven || frame.stop == StopReason::kResting) continue;
    solve_ms.push_back(frame.solve_ms);
    iterations.push_back(frame.iterations);
    summary.failed += frame.stop == StopReason::kFailed;
    summary.at_iteration_limit += frame.stop == StopReason::kIterationLimit;
  }
  summary.solve_ms = Median(solve_ms);
  summary.iterations = Median(iterations);
  summary.contact = Summarize(contact);
  return summary;
}

std::string SummaryText(const FitSummary& summary, const ContactProtocol& protocol) {
  const ContactSummary& contact = summary.contact;
  return fmt::format(
      "  in contact          {:.1f} % of frames ({:.1f} % of the hand within {:g} mm)\n"
      "  penetration         deepest {:.2f} mm; mean over frames: deepest {:.2f} mm, vertices "
      "inside {:.2f} mm\n"
      "  intersection        {:.3f} cm3 (mean; {:g} mm voxels)\n"
      "  solved              {:.2f} ms per frame (median), {:g} iterations; {} failed\n",
      100.0 * contact.frames_in_contact_ratio, 100.0 * contact.mean_contact_ratio,
      protocol.contact_threshold_mm, contact.max_penetration_mm, contact.mean_max_penetration_mm,
      contact.mean_penetration_mm, contact.mean_intersection_volume_cm3, protocol.voxel_mm,
      summary.solve_ms, summary.iterations, summary.failed);
}

nlohmann::json SummaryJson(const FitSummary& summary) {
  const ContactSummary& contact = summary.contact;
  return {{"frames", summary.frames},
          {"contact_pairs", summary.contact_pairs},
          {"frames_failed", summary.failed},
          {"frames_at_iteration_limit", summary.at_iteration_limit},
          {"solve_ms_median", summary.solve_ms},
          {"iterations_median", summary.iterations},
          {"frames_in_contact_ratio", contact.frames_in_contact_ratio},
          {"contact_ratio", contact.mean_contact_ratio},
          {"max_penetration_depth_mm", contact.max_penetration_mm},
          {"mean_max_penetration_depth_mm", contact.mean_max_penetration_mm},
          {"mean_penetration_depth_mm", contact.mean_penetration_mm},
          {"mean_intersection_volume_cm3", contact.mean_intersection_volume_cm3}};
}

nlohmann::json PerFrameJson(const FitResult& result, const std::vector<ContactMetrics>& contact) {
  using F = FrameReport;
  using C = ContactMetrics;
  return {
      {"energy_distance_m2", PerFrame(result.frames, [](const F& f) { return f.energy_distance; })},
      {"energy_contact_m2", PerFrame(result.frames, [](const F& f) { return f.energy_contact; })},
      {"energy_temporal", PerFrame(result.frames, [](const F& f) { return f.energy_temporal; })},
      {"energy_penetration_m2",
       PerFrame(result.frames, [](const F& f) { return f.energy_penetration; })},
      {"energy_object_in_hand_m2",
       PerFrame(result.frames, [](const F& f) { return f.energy_object_in_hand; })},
      {"wrist_offset_mm",
       PerFrame(result.frames, [](const F& f) { return 1000.0 * f.wrist_offset_m; })},
      {"energy_total", PerFrame(result.frames, [](const F& f) { return f.energy_total; })},
      {"iterations", PerFrame(result.frames, [](const F& f) { return f.iterations; })},
      {"solve_ms", PerFrame(result.frames, [](const F& f) { return f.solve_ms; })},
      {"stop", PerFrame(result.frames, [](const F& f) { return StopReasonName(f.stop); })},
      {"contact_ratio", PerFrame(contact, [](const C& c) { return c.contact_ratio; })},
      {"in_contact", PerFrame(contact, [](const C& c) { return c.in_contact; })},
      {"penetration_depth_mm", PerFrame(contact, [](const C& c) { return c.max_penetration_mm; })},
      {"mean_penetration_depth_mm",
       PerFrame(contact, [](const C& c) { return c.mean_penetration_mm; })},
      {"intersection_volume_cm3",
       PerFrame(contact, [](const C& c) { return c.intersection_volume_cm3; })}};
}

nlohmann::json ProtocolJson(const ContactProtocol& protocol, const TriangleMesh& object,
                            const SignedDistance& surface, const HandModel& hand) {
  return {
      {"penetration",
       "depth of hand vertices inside the object, exact signed distance to the "
       "full-resolution mesh"},
      {"contact", "a hand vertex is in contact when |signed distance| is below the threshold"},
      {"contact_threshold_mm", protocol.contact_threshold_mm},
      {"intersection_volume", "voxel centres inside both object and hand (closed at the wrist)"},
      {"voxel_mm", protocol.voxel_mm},
      {"hand_vertices", hand.NumVertices()},
      {"object_vertices", object.NumVertices()},
      {"inside_by", surface.SignMethod() == SignedDistance::Sign::kPseudonormal
                        ? "pseudonormal"
                        : "winding number"}};
}

}  // namespace holdfast::apps
