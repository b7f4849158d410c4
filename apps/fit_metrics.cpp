// SPDX-License-Identifier: MIT
#include "apps/fit_metrics.h"

#include <algorithm>
#include <utility>

#include <ceres/types.h>
#include <ceres/version.h>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/json_text.h"
#include "solver/fit/frame_fitter.h"

namespace holdfast::apps {
namespace {

// In quotes where it would end a cell.
std::string CsvCell(std::string text) {
  text = AsUtf8(text);
  if (text.find_first_of(",\"\r\n") == text.npos) return text;
  for (std::size_t at = 0; (at = text.find('"', at)) != text.npos; at += 2) text.insert(at, 1, '"');
  return '"' + text + '"';
}

std::string CsvCell(const nlohmann::json& value) {
  if (value.is_null()) return {};
  if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
  return CsvCell(value.is_string() ? value.get<std::string>() : JsonText(value));
}

}  // namespace

nlohmann::json WeightsJson(const FitOptions& options) {
  nlohmann::json weights;
  for (const EnergyTermInfo& info : EnergyTerms()) {
    weights[fmt::format("lambda_{}", info.name)] = options.*info.weight;
  }
  return weights;
}

nlohmann::json SolverJson(const FitOptions& options) {
  const ceres::Solver::Options solver = FrameSolverOptions(options);
  return {{"library", "Ceres " CERES_VERSION_STRING},
          {"minimizer", ceres::TrustRegionStrategyTypeToString(solver.trust_region_strategy_type)},
          {"linear_solver", ceres::LinearSolverTypeToString(solver.linear_solver_type)},
          {"max_iterations", solver.max_num_iterations},
          {"step_tolerance", solver.parameter_tolerance},
          {"function_tolerance", solver.function_tolerance}};
}

CLI::Option* AddWeightOption(CLI::App& command, EnergyTerm term, FitOptions& options) {
  const EnergyTermInfo& info = EnergyTerms()[static_cast<std::size_t>(term)];
  std::string flag = fmt::format("--lambda-{}", info.name);
  std::ranges::replace(flag, '_', '-');
  return AddOption(command, flag.c_str(), options.*info.weight, info.help, CLI::NonNegativeNumber);
}

std::string SummaryText(const nlohmann::json& summary, const ContactProtocol& protocol) {
  const auto number = [&](const char* name) {
    const nlohmann::json& value = summary.at(name);
    return value.is_null() ? 0.0 : value.get<double>();
  };
  return fmt::format(
      "  in contact          {:.1f} % of the frames held ({:.1f} % of the hand within {:g} mm)\n"
      "  penetration         deepest {:.2f} mm, both ways; mean over frames: deepest {:.2f} mm, "
      "hand vertices inside {:.2f} mm\n"
      "  intersection        {:.3f} cm3 (mean; {:g} mm voxels)\n"
      "  solved              {:.2f} ms per frame (median), {:g} iterations; {} failed\n",
      100.0 * number("frames_in_contact_ratio"), 100.0 * number("contact_ratio"),
      protocol.contact_threshold_mm, number("max_penetration_depth_mm"),
      number("mean_max_penetration_depth_mm"), number("mean_penetration_depth_mm"),
      number("mean_intersection_volume_cm3"), protocol.voxel_mm, number("solve_ms_median"),
      number("iterations_median"), summary.at("frames_failed").get<int>());
}

std::string ClearanceText(const ClearanceReport& report) {
  const double deep_m = ClearanceOptions{}.deep_m;
  std::string left = fmt::format("{} of {} frames deeper than {:g} mm", report.deep,
                                 report.frames.size(), 1e3 * deep_m);
  const auto is_deep = [&](std::size_t t) {
    return t < report.frames.size() && report.frames[t].depth_m > deep_m;
  };
  std::string_view before = ": frames ";
  for (std::size_t t = 0, begin = 0; t < report.frames.size(); ++t) {
    if (!is_deep(t)) continue;
    if (t == 0 || !is_deep(t - 1)) begin = t;
    if (is_deep(t + 1)) continue;
    left += fmt::format("{}{}", before, begin);
    if (t > begin) left += fmt::format("-{}", t);
    before = ", ";
  }
  if (report.moved) {
    return fmt::format(
        "  body                arms gave way by up to {:.1f} cm so that they and the object keep "
        "out "
        "of the body; {} (before: {}, up to {:.0f} mm)\n",
        100.0 * std::max(report.shift_max_m, report.free_shift_max_m), left, report.deep_before,
        1e3 * report.worst_before_m);
  }
  if (report.deep == 0) return {};
  return fmt::format("  body                the {} is up to {:.0f} mm deep in it; {}\n",
                     MeetingPartName(report.worst_part), 1e3 * report.worst_m, left);
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
