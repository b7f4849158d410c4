// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "solver/score/score_output.h"

namespace holdfast {
namespace {

constexpr std::size_t kMostColumns = 4;  // clips beside each other in a terminal
constexpr std::size_t kWidestName = 22;

std::string Number(const std::optional<double>& value, const MetricDefinition& metric) {
  if (!value) return "-";
  const double shown = metric.unit == "%" ? 100.0 * *value : *value;
  return fmt::format("{:.{}f}", shown, metric.digits);
}

// What tells a clip from others at a glance: its folder's or its file's name.
std::string ShortName(const ClipScore& score) {
  std::filesystem::path path = score.source;
  if (!path.has_filename()) path = path.parent_path();
  std::string name = path.filename().string();
  if (name == "clip.npz" && path.has_parent_path()) name = path.parent_path().filename().string();
  if (path.extension() == ".npz" && name.ends_with(".npz")) name.resize(name.size() - 4);
  if (name.size() > kWidestName) name = "..." + name.substr(name.size() - kWidestName + 3);
  return score.foreign_body ? name + "*" : name;
}

struct TableRow {
  std::string label, unit;
  std::vector<std::string> cells;
};

std::string Layout(const std::vector<TableRow>& rows) {
  std::vector<std::size_t> widths;
  std::size_t label = 0, unit = 0;
  for (const TableRow& row : rows) {
    label = std::max(label, row.label.size());
    unit = std::max(unit, row.unit.size());
    widths.resize(std::max(widths.size(), row.cells.size()), 0);
    for (std::size_t c = 0; c < row.cells.size(); ++c) {
      widths[c] = std::max(widths[c], row.cells[c].size());
    }
  }
  std::string text;
  for (const TableRow& row : rows) {
    std::string line = fmt::format("{:<{}}  {:<{}}", row.label, label, row.unit, unit);
    for (std::size_t c = 0; c < row.cells.size(); ++c) {
      line += fmt::format("  {:>{}}", row.cells[c], widths[c]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

void AppendTexts(std::span<const ClipScore> scores, const ScoreOptions& options,
                 std::string& text) {
  if (std::ranges::any_of(scores, &ClipScore::foreign_body)) {
    text += "* another body model than the clip's own: contact rows are of that body's hand\n";
  }
  for (const ClipScore& score : scores) {
    if (score.reference && !score.reference->object.empty()) {
      text += fmt::format("{}: object symmetry: {}; diameter {:.1f} mm\n", ShortName(score),
                          Describe(score.reference->symmetry), score.reference->diameter_mm);
    }
    const auto worst = [&](const char* what, const BodyDepth& depth) {
      if (depth.max_mm <= options.deep_mm) return;
      text += fmt::format("{}: {} deepest in the own body in frame {}, by {:.1f} mm\n",
                          ShortName(score), what, depth.worst_frame, depth.max_mm);
    };
    if (score.own_body && score.own_body->object) worst("object", *score.own_body->object);
    if (score.own_body) worst("arms", score.own_body->arms);
    for (const std::string& note : score.notes) {
      text += fmt::format("{}: {}\n", ShortName(score), note);
    }
  }
  const bool contact = std::ranges::any_of(scores, [](auto& s) { return !s.hands.empty(); });
  if (!contact) return;
  text += fmt::format(
      "in contact: within {:g} mm; both meshes at full resolution; definitions: docs/metrics.md, "
      "--json\n",
      options.hand_object.contact.contact_threshold_mm);
}

// One column per clip; the hands of a clip that uses both in columns behind it.
std::string TableOfColumns(std::span<const ClipScore> scores, const ScoreOptions& options,
                           bool summarize) {
  std::vector<MetricValues> values;
  std::vector<std::vector<MetricValues>> hand_values;
  for (const ClipScore& score : scores) {
    values.push_back(ClipValues(score, options));
    std::vector<MetricValues>& hands = hand_values.emplace_back();
    for (std::size_t h = 0; h < score.hands.size() && score.hands.size() > 1; ++h) {
      hands.push_back(HandValues(score, h, options));
    }
  }
  std::vector<TableRow> rows(1);
  for (std::size_t c = 0; c < scores.size(); ++c) {
    rows[0].cells.push_back(ShortName(scores[c]));
    for (std::size_t h = 0; h < hand_values[c].size(); ++h) {
      rows[0].cells.push_back(scores[c].hands[h].side == Side::kRight ? "right" : "left");
    }
  }
  if (summarize) {
    for (const char* name : {"mean", "median", "worst", ""}) rows[0].cells.push_back(name);
  }
  TableRow about{"frames, hand", "", {}};
  for (std::size_t c = 0; c < scores.size(); ++c) {
    const ClipScore& score = scores[c];
    about.cells.push_back(fmt::format("{}, {}", score.frames,
                                      score.hands.empty() ? "-"
                                      : score.hands.size() > 1
                                          ? "both"
                                          : std::string(SideName(score.hands[0].side))));
    for (std::size_t h = 0; h < hand_values[c].size(); ++h) {
      about.cells.push_back(fmt::format("{}", score.hands[h].FramesHeld()));
    }
  }
  rows.push_back(about);
  std::optional<MetricDefinition::Group> group;
  for (const MetricDefinition& metric : MetricDefinitions(options)) {
    const auto known = [&](const MetricValues& v) { return v.at(metric.key).has_value(); };
    if (std::ranges::none_of(values, known)) continue;
    if (group && *group != metric.group) rows.push_back({});
    group = metric.group;
    TableRow row{metric.label, metric.unit, {}};
    for (std::size_t c = 0; c < values.size(); ++c) {
      row.cells.push_back(Number(values[c].at(metric.key), metric));
      for (const MetricValues& hand : hand_values[c]) {
        row.cells.push_back(metric.per_hand ? Number(hand.at(metric.key), metric) : "");
      }
    }
    const auto summary = SummarizeMetric(metric, values);
    if (summarize && summary) {
      row.cells.push_back(Number(summary->mean, metric));
      row.cells.push_back(Number(summary->median, metric));
      row.cells.push_back(Number(summary->worst, metric));
      row.cells.push_back(ShortName(scores[summary->worst_clip]));
    }
    rows.push_back(std::move(row));
  }
  return Layout(rows);
}

// A line per clip with what is asked first, and the whole summary.
std::string TableOfRows(std::span<const ClipScore> scores, const ScoreOptions& options) {
  std::vector<MetricValues> values;
  for (const ClipScore& score : scores) values.push_back(ClipValues(score, options));
  const std::vector<MetricDefinition> metrics = MetricDefinitions(options);
  std::vector<MetricDefinition> heads;
  for (const char* key :
       {"deep_penetration_frames_ratio", "penetration_max_mm", "intersection_volume_cm3",
        "object_in_body_max_mm", "self_penetration_max_mm", "contact_frames_ratio",
        "contact_drift_max_mm", "jitter_acceleration_ratio", "foot_skate_mm_per_frame", "mpjpe_mm",
        "object_add_mm"}) {
    const auto metric = std::ranges::find(metrics, key, &MetricDefinition::key);
    const auto known = [&](const MetricValues& v) { return v.at(key).has_value(); };
    if (std::ranges::any_of(values, known)) heads.push_back(*metric);
  }
  std::vector<TableRow> rows(2);
  rows[0].label = "clip";
  for (const MetricDefinition& metric : heads) {
    rows[0].cells.push_back(metric.label);
    rows[1].cells.push_back(metric.unit);
  }
  for (std::size_t c = 0; c < scores.size(); ++c) {
    TableRow row{ShortName(scores[c]), "", {}};
    for (const MetricDefinition& metric : heads) {
      row.cells.push_back(Number(values[c].at(metric.key), metric));
    }
    rows.push_back(std::move(row));
  }
  std::string text = Layout(rows) + "\n";
  std::vector<TableRow> summaries = {
      {fmt::format("over {} clips", scores.size()), "", {"mean", "median", "worst", "", "clips"}}};
  for (const MetricDefinition& metric : metrics) {
    const auto summary = SummarizeMetric(metric, values);
    if (!summary) continue;
    summaries.push_back({metric.label,
                         metric.unit,
                         {Number(summary->mean, metric), Number(summary->median, metric),
                          Number(summary->worst, metric), ShortName(scores[summary->worst_clip]),
                          std::to_string(summary->count)}});
  }
  return text + Layout(summaries);
}

}  // namespace

std::string ScoreTable(std::span<const ClipScore> scores, const ScoreOptions& options) {
  std::string text = scores.size() <= kMostColumns
                         ? TableOfColumns(scores, options, scores.size() > 1)
                         : TableOfRows(scores, options);
  text += "\n";
  AppendTexts(scores, options, text);
  return text;
}

std::string ScoreCsv(std::span<const ClipScore> scores, const ScoreOptions& options) {
  const std::vector<MetricDefinition> metrics = MetricDefinitions(options);
  const auto quoted = [](const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string out = "\"";
    for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + "\"";
  };
  const auto cell = [](const std::optional<double>& value) {
    return value ? fmt::format(",{:.9g}", *value) : std::string(",");
  };
  std::string text = "clip,frames,hands,foreign_body";
  for (const MetricDefinition& metric : metrics) text += "," + metric.key;
  text += "\n";
  std::vector<MetricValues> values;
  for (const ClipScore& score : scores) {
    values.push_back(ClipValues(score, options));
    std::string hands;
    for (const HandObjectScore& hand : score.hands) {
      hands += (hands.empty() ? "" : "+") + std::string(SideName(hand.side));
    }
    text += fmt::format("{},{},{},{}", quoted(score.source), score.frames, hands,
                        score.foreign_body ? 1 : 0);
    for (const MetricDefinition& metric : metrics) text += cell(values.back().at(metric.key));
    text += "\n";
  }
  for (const auto& [name, member] :
       {std::pair("(mean)", &MetricSummary::mean), std::pair("(median)", &MetricSummary::median),
        std::pair("(worst)", &MetricSummary::worst)}) {
    if (scores.size() < 2) break;
    text += fmt::format("{},,,", name);
    for (const MetricDefinition& metric : metrics) {
      const auto summary = SummarizeMetric(metric, values);
      text += cell(summary ? std::optional((*summary).*member) : std::nullopt);
    }
    text += "\n";
  }
  return text;
}

}  // namespace holdfast
