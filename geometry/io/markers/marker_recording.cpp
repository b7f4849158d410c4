// SPDX-License-Identifier: MIT
#include "geometry/io/markers/marker_recording.h"

#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/markers/c3d.h"
#include "geometry/io/markers/marker_tables.h"

namespace holdfast {
namespace {

std::string_view WithoutByteOrderMark(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return text;
}

}  // namespace

std::optional<int> MarkerRecording::Find(std::string_view name) const {
  for (int m = 0; m < NumMarkers(); ++m) {
    if (EqualIgnoringCase(names[m], name)) return m;
  }
  return std::nullopt;
}

std::string_view MarkerFormatOf(std::string_view head) {
  if (LooksLikeC3d(head)) return "C3D";
  head = WithoutByteOrderMark(head);
  if (head.starts_with("PathFileType")) return "TRC";
  if (head.starts_with("Trajectories")) return "Vicon CSV";
  if (head.starts_with("NO_OF_FRAMES")) return "Qualisys TSV";
  return {};
}

MarkerRecording ReadMarkers(const std::filesystem::path& path) {
  return ParseMarkers(ReadGzipText(path), path.string());
}

MarkerRecording ParseMarkers(std::string_view text, const std::string& where) {
  const std::string_view format = MarkerFormatOf(text);
  if (format.empty()) {
    throw Error(where, "is not a known marker recording",
                "Give a C3D, a TRC (begins with PathFileType), a Vicon CSV (Trajectories) or a "
                "Qualisys TSV (NO_OF_FRAMES)");
  }
  const auto parse = format == "C3D"         ? ParseC3d
                     : format == "TRC"       ? ParseTrc
                     : format == "Vicon CSV" ? ParseViconCsv
                                             : ParseQtmTsv;
  MarkerRecording recording = parse(WithoutByteOrderMark(text), where);
  recording.format = format;
  return recording;
}

std::optional<LengthUnit> FindLengthUnit(std::string_view unit) {
  constexpr std::size_t kMinCutOff = 3;
  // Files name units in either spelling.
  constexpr LengthUnit kUnits[] = {
      {"mm", 1e-3},          {"cm", 1e-2},          {"dm", 1e-1},          {"m", 1.0},
      {"in", 0.0254},        {"millimeters", 1e-3}, {"millimetres", 1e-3}, {"centimeters", 1e-2},
      {"centimetres", 1e-2}, {"meters", 1.0},       {"metres", 1.0},       {"inch", 0.0254},
      {"inches", 0.0254}};
  for (const LengthUnit& known : kUnits) {
    if (EqualIgnoringCase(unit, known.name)) return known;
    if (unit.size() < kMinCutOff || unit.size() > known.name.size()) continue;
    if (!EqualIgnoringCase(unit, known.name.substr(0, unit.size()))) continue;
    // The singular counts as a whole word.
    return LengthUnit{known.name, known.meters, unit.size() + 1 < known.name.size()};
  }
  return std::nullopt;
}

void SetMarkerNames(const std::vector<std::string>& labels, const std::string& where,
                    MarkerRecording& recording) {
  std::set<std::string> all, seen;
  std::vector<std::string> renamed, decoded;
  for (const std::string& label : labels) all.insert(AsUtf8(label));
  for (const std::string& bytes : labels) {
    std::string label = AsUtf8(bytes);
    if (label != bytes) decoded.push_back(label);
    if (!seen.insert(label).second) {
      const std::string given = label;
      for (int k = 2; !all.insert(label).second; ++k) label = fmt::format("{}_{}", given, k);
      renamed.push_back(label);
    }
    const std::size_t colon = label.find(':');
    const bool has_subject = colon != std::string::npos && colon + 1 < label.size();
    recording.subjects.push_back(has_subject ? label.substr(0, colon) : "");
    recording.names.push_back(has_subject ? label.substr(colon + 1) : label);
  }
  if (!decoded.empty()) {
    recording.notes.push_back(fmt::format("{}: names that are not UTF-8 are read as Latin-1: {}",
                                          where, fmt::join(decoded, " ")));
  }
  if (!renamed.empty()) {
    recording.notes.push_back(fmt::format(
        "{}: several markers have the same name; those after the first are renamed to {}", where,
        fmt::join(renamed, " ")));
  }
}

}  // namespace holdfast
