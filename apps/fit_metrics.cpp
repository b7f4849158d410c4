// SPDX-License-Identifier: MIT
#include "apps/fit_metrics.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"

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

// In quotes where it would end a cell.
std::string CsvCell(std::string text) {
  if (text.find_first_of(",\"\r\n") == text.npos) return text;
  for (std::size_t at = 0; (at = text.find('"', at)) != text.npos; at += 2) text.insert(at, 1, '"');
  return '"' + text + '"';
}

std::string CsvCell(const nlohmann::json& value) {
  if (value.is_null()) return {};
  if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
  return CsvCell(value.is_string() ? value.get<std::string>() : value.dump());
}

}  // namespace

nlohmann::json WeightsJson(const FitOptions& options) {
  nlohmann::json weights;
  for (const EnergyTermInfo& info : EnergyTerms()) {
    weights[fmt::format("lambda_{}", info.name)] = options.*info.weight;
  }
  return weights;
}

CLI::Option* AddWeightOption(CLI::App& command, EnergyTerm term, FitOptions& options) {
  const EnergyTermInfo& info = EnergyTerms()[static_cast<std::size_t>(term)];
  std::string flag = fmt::format("--lambda-{}", info.name);
  std::ranges::replace(flag, '_', '-');
  return AddOption(command, flag.c_str(), options.*info.weight, info.help, CLI::NonNegativeNumber);
}

nlohmann::json FirstGraspJson(const FirstGrasp& first) {
  nlohmann::json json = {{"made", first.made}};
  if (!first.made) return json;
  json["status"] = first.status;
  if (first.one) {
    const Grasp& grasp = *first.one;
    json.update({{"style", StyleName(grasp.style)},
                 {"score", grasp.score},
                 {"wrench_quality", grasp.wrench_quality},
                 {"skin_in_object_mm", grasp.max_penetration_mm},
                 {"object_in_hand_mm", grasp.object_in_hand_mm},
                 {"frames_through_body_ratio", first.through_body},
                 {"search_ms", first.search_ms}});
  }
  if (first.both && first.found) {
    json["width_mm"] = 1000.0 * first.both->width_m;
    json["body_in_object_mm"] = first.both->in_body_mm;
    for (int h = 0; h < 2; ++h) {
      json[h == 0 ? "right" : "left"] = {
          {"skin_in_object_mm", first.both->hands[h].max_penetration_mm},
          {"wrist_shift_mm", first.both->wrist_shift_mm[h]},
          {"wrist_turn_deg", first.both->wrist_turn_deg[h]}};
    }
  }
  return json;
}

FitSummary SummarizeFit(const FitResult& result, ContactScore contact) {
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
  summary.contact = std::move(contact);
  return summary;
}

std::string SummaryText(const FitSummary& summary, const ContactProtocol& protocol) {
  const ContactScore& contact = summary.contact;
  return fmt::format(
      "  in contact          {:.1f} % of the frames held ({:.1f} % of the hand within {:g} mm)\n"
      "  penetration         deepest {:.2f} mm, both ways; mean over frames: deepest {:.2f} mm, "
      "hand vertices inside {:.2f} mm\n"
      "  intersection        {:.3f} cm3 (mean; {:g} mm voxels)\n"
      "  solved              {:.2f} ms per frame (median), {:g} iterations; {} failed\n",
      100.0 * contact.contact_frames_ratio.value_or(0.0),
      100.0 * contact.contact_ratio.value_or(0.0), protocol.contact_threshold_mm,
      contact.penetration_max_mm, contact.penetration_mean_max_mm, contact.penetration_mean_mm,
      contact.voxel_volume_cm3, protocol.voxel_mm, summary.solve_ms, summary.iterations,
      summary.failed);
}

nlohmann::json SummaryJson(const FitSummary& summary) {
  const ContactScore& contact = summary.contact;
  return {{"frames", summary.frames},
          {"contact_pairs", summary.contact_pairs},
          {"frames_failed", summary.failed},
          {"frames_at_iteration_limit", summary.at_iteration_limit},
          {"solve_ms_median", summary.solve_ms},
          {"iterations_median", summary.iterations},
          {"frames_in_contact_ratio", contact.contact_frames_ratio.value_or(0.0)},
          {"contact_ratio", contact.contact_ratio.value_or(0.0)},
          {"frames_deeper_than_2_mm", contact.deep_frames},
          {"max_penetration_depth_mm", contact.penetration_max_mm},
          {"mean_max_penetration_depth_mm", contact.penetration_mean_max_mm},
          {"mean_penetration_depth_mm", contact.penetration_mean_mm},
          {"object_in_hand_max_mm", contact.object_in_hand_max_mm},
          {"mean_intersection_volume_cm3", contact.voxel_volume_cm3}};
}

std::string ClearanceText(const ClearanceReport& report) {
  const std::string left = fmt::format("{} of {} frames deeper than {:g} mm", report.deep,
                                       report.held_frames, 1e3 * ClearanceOptions{}.deep_m);
  if (report.moved) {
    return fmt::format(
        "  body                the arm gave way by up to {:.1f} cm so that the object keeps out of "
        "the body; {} (before: {}, up to {:.0f} mm)\n",
        100.0 * report.shift_max_m, left, report.deep_before, 1e3 * report.worst_before_m);
  }
  if (report.deep == 0) return {};
  return fmt::format("  body                the {} is up to {:.0f} mm deep in it; {}\n",
                     MeetingPartName(report.worst_part), 1e3 * report.worst_m, left);
}

nlohmann::json PerFrameJson(const FitResult& result, const ContactScore& contact,
                            const ClearanceReport& clearance) {
  using F = FrameReport;
  using B = ClearanceReport::Frame;
  using C = ContactScore::Frame;
  nlohmann::json columns = {
      {"wrist_offset_mm",
       PerFrame(result.frames, [](const F& f) { return 1000.0 * f.wrist_offset_m; })},
      {"energy_total", PerFrame(result.frames, [](const F& f) { return f.energy_total; })},
      {"iterations", PerFrame(result.frames, [](const F& f) { return f.iterations; })},
      {"solve_ms", PerFrame(result.frames, [](const F& f) { return f.solve_ms; })},
      {"stop", PerFrame(result.frames, [](const F& f) { return StopReasonName(f.stop); })},
      {"contact_ratio", PerFrame(contact.frames, [](const C& c) { return c.contact_ratio; })},
      {"in_contact", PerFrame(contact.frames, [](const C& c) { return c.in_contact; })},
      {"penetration_depth_mm",
       PerFrame(contact.frames, [](const C& c) { return c.penetration_mm; })},
      {"mean_penetration_depth_mm",
       PerFrame(contact.frames, [](const C& c) { return c.mean_penetration_mm; })},
      {"intersection_volume_cm3",
       PerFrame(contact.frames, [](const C& c) { return c.voxel_volume_cm3; })}};
  if (!clearance.frames.empty()) {
    columns["depth_in_body_mm"] =
        PerFrame(clearance.frames, [](const B& b) { return 1000.0 * b.depth_m; });
    columns["wrist_shift_mm"] =
        PerFrame(clearance.frames, [](const B& b) { return 1000.0 * b.wrist_shift_m; });
  }
  for (const EnergyTermInfo& info : EnergyTerms()) {
    if (info.metric == nullptr) continue;
    nlohmann::json column =
        PerFrame(result.frames, [&](const F& f) { return f.energies[info.term]; });
    // E_s stands in place of E_d and E_c, in few fits.
    const bool is_off = info.term == EnergyTerm::kSlip &&
                        std::ranges::all_of(column, [](const auto& value) { return value == 0.0; });
    if (!is_off) columns[info.metric] = std::move(column);
  }
  return columns;
}

std::string PerFrameCsv(const nlohmann::json& metrics, const std::string& source, double frame_rate,
                        int frames, int begin, int count) {
  const nlohmann::json columns =
      metrics.is_object() ? metrics.value("per_frame", nlohmann::json()) : nlohmann::json();
  if (!columns.is_object() || columns.empty()) {
    throw Error(
        source, "has no metrics.json with values per frame",
        "Give a folder that 'fit', 'offhand', 'refine' or 'reach' wrote, or measure the clip "
        "with 'holdfast score --json --per-frame'");
  }
  std::string table = "frame,time_s";
  for (const auto& [name, column] : columns.items()) {
    if (!column.is_array() || column.size() != static_cast<std::size_t>(frames)) {
      throw Error(source,
                  fmt::format("has {} frames, but metrics.json not as many of '{}'", frames, name),
                  "Make the result anew");
    }
    table += "," + CsvCell(name);
  }
  table += '\n';
  for (int t = 0; t < count; ++t) {
    table += fmt::format("{},{:.6f}", t, t / frame_rate);
    for (const auto& column : columns) {
      table += "," + CsvCell(column[static_cast<std::size_t>(begin + t)]);
    }
    table += '\n';
  }
  return table;
}

nlohmann::json ProtocolJson(const ContactProtocol& protocol, const Solid& object,
                            const HandModel& hand) {
  return {
      {"penetration",
       "depth of hand vertices inside the object and of object vertices inside the hand (closed "
       "at the wrist), exact signed distance to full-resolution meshes; mean_penetration: of hand "
       "vertices alone"},
      {"contact", "a hand vertex is in contact when |signed distance| is below the threshold"},
      {"contact_threshold_mm", protocol.contact_threshold_mm},
      {"intersection_volume", "voxel centres inside both object and hand (closed at the wrist)"},
      {"voxel_mm", protocol.voxel_mm},
      {"hand_vertices", hand.NumVertices()},
      {"object_vertices", object.mesh.NumVertices()},
      {"inside_by", object.IsClosed() ? "pseudonormal" : "winding number"}};
}

}  // namespace holdfast::apps
