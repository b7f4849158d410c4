// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_synthesis_page.h"

#include <algorithm>

#include <fmt/format.h>

#include "apps/charts.h"
#include "apps/page.h"

namespace holdfast::apps {
namespace {

constexpr const char* kNone = "-";

std::string Cell(const imos::RepeatedValue& value, int digits) {
  std::string text = fmt::format("{:.{}f}", value.mean, digits);
  if (value.repeats > 1) text += fmt::format(" ± {:.{}f}", value.interval, digits);
  return text;
}
std::string Cell(const std::optional<imos::RepeatedValue>& value, int digits) {
  return value ? Cell(*value, digits) : kNone;
}
std::string Cell(const std::optional<PaperValue>& value, int digits, int interval_digits) {
  return value ? fmt::format("{:.{}f} ± {:.{}f}", value->mean, digits, value->interval,
                             interval_digits)
               : kNone;
}

std::optional<imos::RepeatedValue> InCentimeters(std::optional<imos::RepeatedValue> meters) {
  if (meters) {
    meters->mean *= 100.0;
    meters->interval *= 100.0;
  }
  return meters;
}

std::string Number(const SynthesisSummary& summary, const char* key, double factor, int digits) {
  const auto found = summary.objects.find(key);
  if (found == summary.objects.end() || !found->second) return kNone;
  return fmt::format("{:.{}f}", factor * *found->second, digits);
}

std::string Seconds(double seconds) {
  if (seconds <= 0.0) return kNone;
  return seconds < 0.1 ? fmt::format("{:.1f} ms", 1e3 * seconds) : fmt::format("{:.2f} s", seconds);
}

// Rows of a table for a mode: what is the same for all modes, then its networks.
std::vector<const SynthesisResult*> RowsFor(std::span<const SynthesisResult> results,
                                            ObjectMode mode, bool clips) {
  std::vector<const SynthesisResult*> rows;
  for (const SynthesisResult& result : results) {
    if (result.row.kind == RowKind::kClip && !clips) continue;
    const bool made = result.row.kind == RowKind::kNetwork || result.row.kind == RowKind::kMean;
    if (made && result.row.mode != mode) continue;
    rows.push_back(&result);
  }
  return rows;
}

std::string PlacedText(ObjectMode mode) {
  switch (mode) {
    case ObjectMode::kGiven:
      return "True object poses in the history, as the authors' evaluation has it";
    case ObjectMode::kCarried:
      return "Objects carried rigidly by the wrist that truly carries them";
    case ObjectMode::kFitted:
      return "Objects fitted in every key frame, then strokes laid in: the whole loop";
  }
  return "";
}

void Mark(const SynthesisResult& result, TextTable& table) {
  if (result.row.key == "full") table.strong.push_back(static_cast<int>(table.rows.size()) - 1);
}

TextTable MotionTable(std::span<const SynthesisResult> results, ObjectMode mode, bool published) {
  TextTable table;
  table.title = fmt::format("Motion, by the {} definitions; objects {}",
                            published ? "authors' code's" : "field's", ObjectModeName(mode));
  table.about = PlacedText(mode) + ".";
  table.heads = {"",
                 "MPJPE, m ↓",
                 published ? "AVE (code) ↓" : "AVE, m2 ↓",
                 published ? "FID (code) ↓" : "FID ↓",
                 "accuracy ↑",
                 "diversity →",
                 "multimodality →"};
  const bool faces = !published && mode != ObjectMode::kGiven;
  if (faces) table.heads.push_back("object at the face, cm ↓");
  for (const SynthesisResult* result : RowsFor(results, mode, false)) {
    const SynthesisSummary& s = result->summary;
    table.rows.push_back({result->row.label, Cell(s.mpjpe_m, 4),
                          published ? Cell(s.ave_code, 3) : Cell(s.ave_m2, 5),
                          published ? Cell(s.fid_code, 3) : Cell(s.fid, 3), Cell(s.accuracy, 3),
                          published ? Cell(s.diversity_code, 3) : Cell(s.diversity, 3),
                          published ? Cell(s.multimodality_code, 3) : Cell(s.multimodality, 3)});
    if (faces) table.rows.back().push_back(Cell(InCentimeters(s.face_m), 1));
    Mark(*result, table);
  }
  if (!published) {
    table.about +=
        " FID of real motion: of two random halves of it, half as many each, which is what chance "
        "makes.";
  }
  return table;
}

TextTable PaperTable() {
  TextTable table;
  table.title = "The paper's Table 2 (GRAB), by the authors' code's definitions";
  table.about = "Other data, other recognition network: orders may be compared, numbers may not.";
  table.heads = {"",           "MPJPE, m ↓",  "AVE (code) ↓",   "FID (code) ↓",
                 "accuracy ↑", "diversity →", "multimodality →"};
  for (const PaperSynthesisRow& row : PaperSynthesisRows()) {
    table.rows.push_back({row.label, Cell(row.mpjpe, 2, 3), Cell(row.ave, 2, 3),
                          Cell(row.fid, 2, 3), Cell(std::optional(row.accuracy), 2, 3),
                          Cell(std::optional(row.diversity), 2, 3),
                          Cell(std::optional(row.multimodality), 2, 3)});
    if (std::string_view(row.key) == "full") {
      table.strong.push_back(static_cast<int>(table.rows.size()) - 1);
    }
  }
  return table;
}

TextTable ObjectTable(std::span<const SynthesisResult> results, ObjectMode mode) {
  TextTable table;
  table.title = fmt::format("Hand and object, which the paper never measured; objects {}",
                            ObjectModeName(mode));
  table.about =
      mode == ObjectMode::kFitted
          ? "Clips of 30 frames a second, feet locked, strokes laid in, all frames fitted: what "
            "'synthesize' gives."
          : "Key frames joined by curves at 30 frames a second; fingers as in the last given "
            "frame.";
  table.about += " As 'holdfast score' measures; means over sequences, medians for shake.";
  table.heads = {"",
                 "frames deeper than 2 mm",
                 "deepest, mean",
                 "frames in contact",
                 "slip",
                 "drift",
                 "object's shake / wrist's",
                 "turning",
                 "object's accel.",
                 "joints' accel.",
                 "foot skating"};
  for (const SynthesisResult* result : RowsFor(results, mode, true)) {
    if (result->row.kind == RowKind::kMean) continue;  // clips are measured seed by seed
    const SynthesisSummary& s = result->summary;
    const auto unit = [&](const char* key, double factor, int digits, const char* name) {
      const std::string number = Number(s, key, factor, digits);
      return number == kNone ? number : number + " " + name;
    };
    table.rows.push_back(
        {result->row.label, unit("deep_penetration_frames_ratio", 100.0, 1, "%"),
         unit("penetration_max_mm", 1.0, 1, "mm"), unit("contact_frames_ratio", 100.0, 1, "%"),
         unit("contact_slip_mm_per_frame", 1.0, 2, "mm/frame"),
         unit("contact_drift_mm", 1.0, 1, "mm"), Number(s, "jitter_acceleration_ratio", 1.0, 2),
         Number(s, "jitter_angular_acceleration_ratio", 1.0, 2),
         unit("object_acceleration_m_s2", 1.0, 2, "m/s2"),
         unit("joint_acceleration_m_s2", 1.0, 2, "m/s2"),
         unit("foot_skate_mm_per_frame", 1.0, 2, "mm/frame")});
    Mark(*result, table);
  }
  return table;
}

std::string ActionChart(std::span<const SynthesisResult> results, ObjectMode mode) {
  Bars bars;
  bars.title = fmt::format("Recognized, by action, objects {}, %", ObjectModeName(mode));
  for (const SynthesisResult* result : RowsFor(results, mode, false)) {
    std::vector<double> values;
    bars.labels.clear();
    for (const ActionAccuracy& one : result->summary.by_action) {
      bars.labels.push_back(one.action);
      values.push_back(one.accuracy);
    }
    bars.series.emplace_back(result->row.label, values);
  }
  bars.width = std::max<int>(400, 80 + 62 * static_cast<int>(bars.labels.size()));
  return BarChart(bars);
}

}  // namespace

std::string SynthesisTimes(std::span<const SynthesisResult> results) {
  std::string text;
  for (const SynthesisResult& result : results) {
    if (!result.row.network) continue;
    text += fmt::format("{}, objects {}: 15 key frames {}, fit of all frames {}\n",
                        result.row.label, ObjectModeName(result.row.mode),
                        Seconds(result.summary.seconds), Seconds(result.summary.finishing_seconds));
  }
  return text;
}

std::vector<TextTable> SynthesisTables(std::span<const SynthesisResult> results,
                                       std::span<const ObjectMode> modes) {
  std::vector<TextTable> tables;
  for (const ObjectMode mode : modes) {
    tables.push_back(MotionTable(results, mode, true));
    tables.push_back(MotionTable(results, mode, false));
  }
  tables.push_back(PaperTable());
  for (const ObjectMode mode : modes) tables.push_back(ObjectTable(results, mode));
  return tables;
}

std::string SynthesisMarkdown(const std::vector<TextTable>& tables,
                              std::span<const SynthesisResult> results,
                              std::span<const ObjectMode> modes) {
  std::string text;
  for (const TextTable& table : tables) {
    text += fmt::format("{}## {}\n\n{}\n\n|", text.empty() ? "" : "\n", table.title, table.about);
    for (const std::string& head : table.heads) text += fmt::format(" {} |", head);
    text += "\n|";
    for (std::size_t k = 0; k < table.heads.size(); ++k) text += "---|";
    text += "\n";
    for (const auto& row : table.rows) {
      text += "|";
      for (const std::string& cell : row) text += fmt::format(" {} |", cell);
      text += "\n";
    }
  }
  for (const ObjectMode mode : modes) {
    const std::vector<std::string> sentences = OrderOfRows(results, mode);
    if (sentences.empty()) continue;
    text += fmt::format("\n## Order of the rows, objects {}\n\n", ObjectModeName(mode));
    for (const std::string& sentence : sentences) text += "- " + sentence + "\n";
  }
  return text;
}

std::string SynthesisPage(const std::vector<std::string>& notes,
                          const std::vector<TextTable>& tables,
                          std::span<const SynthesisResult> results,
                          std::span<const ObjectMode> modes) {
  std::string page = StudyPageHead("Synthesis: motion with objects, by intent");
  for (const std::string& note : notes) page += "<p>" + EscapeHtml(note) + "</p>\n";
  for (const TextTable& table : tables) {
    const bool many = table.heads.size() > 8;
    page += fmt::format("<h2>{}</h2><p>{}</p><div class=\"scroll\"><table{}><tr>",
                        EscapeHtml(table.title), EscapeHtml(table.about),
                        many ? " class=\"many\"" : "");
    for (const std::string& head : table.heads) page += "<th>" + EscapeHtml(head) + "</th>";
    page += "</tr>\n";
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      page += std::ranges::count(table.strong, static_cast<int>(r)) > 0 ? "<tr class=\"full\">"
                                                                        : "<tr>";
      for (const std::string& cell : table.rows[r]) page += "<td>" + EscapeHtml(cell) + "</td>";
      page += "</tr>\n";
    }
    page += "</table></div>\n";
  }
  for (const ObjectMode mode : modes) {
    const std::vector<std::string> sentences = OrderOfRows(results, mode);
    if (sentences.empty()) continue;
    page += fmt::format("<h2>Order of the rows, objects {}</h2><ul>\n", ObjectModeName(mode));
    for (const std::string& sentence : sentences) page += "<li>" + EscapeHtml(sentence) + "</li>\n";
    page += "</ul>\n";
  }
  page += "<h2>Which actions are recognized</h2>\n";
  for (const ObjectMode mode : modes) page += ActionChart(results, mode);
  return page + "</body></html>\n";
}

}  // namespace holdfast::apps
