// SPDX-License-Identifier: MIT
#include "solver/score/score_output.h"

#include <algorithm>
#include <filesystem>
#include <functional>

#include <fmt/format.h>

namespace holdfast {
namespace {

using Json = nlohmann::json;

Json Value(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json Values(const MetricValues& values) {
  Json json = Json::object();
  for (const auto& [key, value] : values) json[key] = Value(value);
  return json;
}

template <typename Items, typename Get>
Json Series(const Items& items, const Get& get) {
  Json series = Json::array();
  for (const auto& item : items) series.push_back(std::invoke(get, item));
  return series;
}

Json PerFrame(const HandObjectScore& hand, const ScoreOptions& options) {
  using F = HandObjectFrame;
  const std::vector<F>& frames = hand.frames;
  Json json = {
      {"hand_in_object_mm", Series(frames, [](const F& f) { return f.hand.max_penetration_mm; })},
      {"hand_in_object_mean_mm",
       Series(frames, [](const F& f) { return f.hand.mean_penetration_mm; })},
      {"object_in_hand_mm", Series(frames, &F::object_max_penetration_mm)},
      {"object_in_hand_mean_mm", Series(frames, &F::object_mean_penetration_mm)},
      {"object_vertices_in_hand", Series(frames, &F::object_vertices_inside)},
      {"contact_ratio", Series(frames, [](const F& f) { return f.hand.contact_ratio; })},
      {"in_contact", Series(frames, [](const F& f) { return f.hand.in_contact; })},
      {"min_distance_mm", Series(frames, [](const F& f) { return f.hand.min_distance_mm; })},
      {"contact_iou", Series(hand.track.steps, [](const ContactStep& s) { return Value(s.iou); })},
      {"contact_slip_mm",
       Series(hand.track.steps, [](const ContactStep& s) { return Value(s.slip_mm); })},
      {"contact_drift_mm", Series(hand.track.drift_mm, Value)}};
  if (options.hand_object.measure_exact) {
    json["intersection_volume_exact_cm3"] = Series(frames, [](const F& f) {
      return f.exact_volume.Known() ? Json(1e6 * f.exact_volume.volume_m3) : Json(nullptr);
    });
    json["intersection_volume_exact_status"] =
        Series(frames, [](const F& f) { return Describe(f.exact_volume.status); });
  }
  if (options.hand_object.measure_voxels) {
    json["intersection_volume_voxel_cm3"] =
        Series(frames, [](const F& f) { return f.hand.intersection_volume_cm3; });
  }
  return json;
}

Json PerFrame(const ReferenceScore& reference) {
  using J = JointError;
  using O = ObjectPoseError;
  Json json = {{"mpjpe_mm", Series(reference.joints, &J::global)},
               {"mpjpe_root_aligned_mm", Series(reference.joints, &J::root_aligned)},
               {"mpjpe_right_hand_mm", Series(reference.joints, &J::right_hand)},
               {"mpjpe_left_hand_mm", Series(reference.joints, &J::left_hand)}};
  if (reference.object.empty()) return json;
  json["object_translation_error_mm"] = Series(reference.object, &O::translation_mm);
  json["object_rotation_error_deg"] = Series(reference.object, &O::rotation_deg);
  json["object_rotation_error_modulo_symmetry_deg"] =
      Series(reference.object, &O::rotation_modulo_deg);
  json["object_add_mm"] = Series(reference.object, &O::add_mm);
  json["object_add_s_mm"] = Series(reference.object, &O::add_s_mm);
  return json;
}

Json SymmetryJson(const ObjectSymmetry& symmetry) {
  Json json = {{"found", Describe(symmetry)},
               {"rotations", symmetry.rotations.size()},
               {"deviation_mm", symmetry.deviation_mm},
               {"center_m", {symmetry.center.x(), symmetry.center.y(), symmetry.center.z()}}};
  if (symmetry.axis) {
    json["axis"] = {symmetry.axis->x(), symmetry.axis->y(), symmetry.axis->z()};
  }
  return json;
}

Json ClipJson(const ClipScore& score, const ScoreOptions& options, bool per_frame) {
  Json json = {{"source", score.source},
               {"frames", score.frames},
               {"frame_rate_hz", score.frame_rate},
               {"body", score.body},
               {"foreign_body", score.foreign_body},
               {"notes", score.notes},
               {"values", Values(ClipValues(score, options))},
               {"hands", Json::array()}};
  if (!score.hands.empty()) {
    json["protocol"] = {
        {"object", score.object_source},      {"object_vertices", score.object_vertices},
        {"object_faces", score.object_faces}, {"hand_vertices", score.hand_vertices},
        {"hand_faces", score.hand_faces},     {"inside_by", score.inside_by},
        {"hands_by", score.hands_by}};
  }
  for (std::size_t h = 0; h < score.hands.size(); ++h) {
    Json hand = {{"side", SideName(score.hands[h].side)},
                 {"values", Values(HandValues(score, h, options))}};
    if (per_frame) {
      hand["per_frame"] = PerFrame(score.hands[h], options);
      if (!score.hands[h].holds.empty()) hand["per_frame"]["holds"] = score.hands[h].holds;
    }
    json["hands"].push_back(std::move(hand));
  }
  if (score.own_body) {
    const OwnBodyScore& body = *score.own_body;
    Json& own = json["own_body"] = {{"self_penetration_worst_frame", body.arms.worst_frame}};
    if (per_frame) own["per_frame"]["self_penetration_mm"] = body.arms.depth_mm;
    if (body.object) {
      own["object_points"] = body.object_points;
      own["object_in_body_worst_frame"] = body.object->worst_frame;
      if (per_frame) own["per_frame"]["object_in_body_mm"] = body.object->depth_mm;
    }
  }
  if (score.reference) {
    json["reference"] = {{"source", score.reference->source},
                         {"frames_compared", score.reference->frames}};
    if (!score.reference->object.empty()) {
      json["reference"]["object_diameter_mm"] = score.reference->diameter_mm;
      json["reference"]["object_symmetry"] = SymmetryJson(score.reference->symmetry);
    }
    if (per_frame) json["reference"]["per_frame"] = PerFrame(*score.reference);
  }
  return json;
}

}  // namespace

void AddScores(std::span<const ClipScore> scores, const ScoreOptions& options, bool per_frame,
               Json& json) {
  const std::vector<MetricDefinition> metrics = MetricDefinitions(options);
  Json& protocol = json["protocol"];
  const ContactProtocol& contact = options.hand_object.contact;
  protocol = {{"contact_threshold_mm", contact.contact_threshold_mm},
              {"depth_threshold_mm", options.deep_mm},
              {"voxel_mm", options.hand_object.measure_voxels ? Json(contact.voxel_mm) : Json()},
              {"exact_volume", options.exact == ExactMode::kOff    ? "off"
                               : options.exact == ExactMode::kAuto ? "auto"
                                                                   : "on"},
              {"meshes",
               "full resolution of object and hand; the hand is closed at the wrist by a "
               "fan around its rim's mean point where a volume is needed"},
              {"hands_combined",
               "depths: the larger of both; volumes: the sum; contact: whether a holding hand is "
               "in contact; consistency, slip, drift and jitter: means weighted by the number of "
               "frames held, the larger of both maxima"}};
  for (const MetricDefinition& metric : metrics) {
    protocol["metrics"][metric.key] = {
        {"definition", metric.definition},
        {"unit", metric.unit == "%"    ? "share of 1"
                 : metric.unit.empty() ? "ratio"
                                       : metric.unit},
        {"worse", metric.worse == MetricDefinition::Worse::kHigher ? "higher" : "lower"},
        {"depends_on_hand_surface", metric.hand_surface}};
  }
  std::vector<MetricValues> values;
  json["clips"] = Json::array();
  for (const ClipScore& score : scores) {
    json["clips"].push_back(ClipJson(score, options, per_frame));
    values.push_back(ClipValues(score, options));
  }
  if (scores.size() < 2) return;
  for (const MetricDefinition& metric : metrics) {
    const auto summary = SummarizeMetric(metric, values);
    if (!summary) continue;
    json["summary"][metric.key] = {{"clips", summary->count},
                                   {"mean", summary->mean},
                                   {"median", summary->median},
                                   {"worst", summary->worst},
                                   {"worst_clip", scores[summary->worst_clip].source}};
  }
}

namespace {

constexpr std::size_t kMaxColumns = 4;  // clips side by side in a terminal
constexpr std::size_t kWidestName = 22;

std::string Number(const std::optional<double>& value, const MetricDefinition& metric) {
  if (!value) return "-";
  const double shown = metric.unit == "%" ? 100.0 * *value : *value;
  return fmt::format("{:.{}f}", shown, metric.digits);
}

// Short name of a clip: that of its folder or file.
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
    text +=
        "* loaded with a different body model than the clip's own: contact rows are of that body's "
        "hand\n";
  }
  for (const ClipScore& score : scores) {
    if (score.reference && !score.reference->object.empty()) {
      text += fmt::format("{}: object symmetry: {}; diameter {:.1f} mm\n", ShortName(score),
                          Describe(score.reference->symmetry), score.reference->diameter_mm);
    }
    const auto worst = [&](const char* what, const BodyDepth& depth) {
      if (depth.max_mm <= options.deep_mm) return;
      text += fmt::format("{}: {} deepest in the body in frame {}, by {:.1f} mm\n",
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

// One column per clip; if it has both hands, their columns follow.
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

// One line per clip with the key metrics, and the full summary.
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
  std::string text = scores.size() <= kMaxColumns
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
