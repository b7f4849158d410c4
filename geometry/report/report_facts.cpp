// SPDX-License-Identifier: MIT
#include "geometry/report/report_facts.h"

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/json_file.h"

namespace holdfast {
namespace {

std::string ShapeText(const ReportInput& input) {
  const bool mean = input.betas.size() == 0 || input.betas.isZero(0.0);
  return mean ? "mean" : fmt::format("{} coefficients of the clip", input.betas.size());
}

}  // namespace

nlohmann::json MetricsBeside(const std::filesystem::path& clip) {
  const std::filesystem::path path = clip.parent_path() / "metrics.json";
  std::error_code ignored;
  if (clip.filename() != "clip.npz" || !std::filesystem::is_regular_file(path, ignored)) {
    return nullptr;
  }
  nlohmann::json metrics = ReadJson(path);
  if (!metrics.is_object()) {
    throw Error(path.string(), "is not the JSON of a result", "Remove it, or make it anew");
  }
  return metrics;
}

nlohmann::json FactsOf(const ReportInput& input, const BodySurface& surface,
                       const CorrectiveBasis& basis) {
  const Clip& clip = input.clip;
  nlohmann::json facts = nlohmann::json::array();
  const auto add = [&](const char* name, std::string value) {
    facts.push_back({name, std::move(value)});
  };
  add("Clip", input.source);
  add("Length", fmt::format("{} frames at {:g} Hz, {:.2f} s", clip.NumFrames(), clip.frame_rate,
                            clip.NumFrames() / clip.frame_rate));
  add("Body model", fmt::format("{}, {} vertices, {} faces", input.body->Name(),
                                surface.NumVertices(), surface.Faces().cols()));
  add("Body shape", ShapeText(input));
  add("Surface shown", fmt::format("within {:.2f} mm of the body model ({} directions of pose "
                                   "correctives)",
                                   1e3 * basis.max_error_m, basis.Size()));
  if (clip.object) add("Object", clip.object->name.empty() ? "unnamed" : clip.object->name);
  if (input.object) {
    const Eigen::Vector3d size = 1e3 * Extent(*input.object);
    add("Object mesh", fmt::format("{} vertices, {} faces", input.object->NumVertices(),
                                   input.object->NumFaces()));
    add("Object size", fmt::format("{:.0f} x {:.0f} x {:.0f} mm", size.x(), size.y(), size.z()));
  }
  return facts;
}

std::vector<std::string> NotesOf(const ReportInput& input) {
  std::vector<std::string> notes;
  const bool matters = input.object || !input.clip.betas.isZero(0.0);
  if (input.foreign_body && matters) {
    notes.push_back(fmt::format(
        "The clip was made with another body model ({}) than the one shown ({}): its shape is not "
        "shown, and contact can be off by centimeters.",
        input.made_with == "SMPL-X" ? "SMPL-X, " + input.clip.gender : input.made_with,
        input.body->Name()));
  }
  if (!input.object_missing.empty()) {
    notes.push_back("The object is not shown: " + input.object_missing);
  }
  for (const char* key : {"notes", "warnings"}) {
    if (!input.metrics.is_object() || !input.metrics.contains(key)) continue;
    for (const nlohmann::json& note : input.metrics[key]) {
      if (note.is_string()) notes.push_back(note.get<std::string>());
    }
  }
  return notes;
}

}  // namespace holdfast
