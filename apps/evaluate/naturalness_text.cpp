// SPDX-License-Identifier: MIT
#include "apps/evaluate/naturalness_page.h"

#include <cmath>

#include <fmt/format.h>

#include "apps/page.h"

namespace holdfast::apps {
namespace {

using nlohmann::json;

json OrNull(double value) { return std::isfinite(value) ? json(value) : json(); }

json SpreadJson(const StyleSpread& s) {
  return {{"motions", s.count},
          {"mean", OrNull(s.mean)},
          {"standard_error", OrNull(s.standard_error)},
          {"deviation", OrNull(s.deviation)},
          {"lower_quartile", OrNull(s.low)},
          {"median", OrNull(s.median)},
          {"upper_quartile", OrNull(s.high)}};
}

json NumbersJson(const Eigen::VectorXd& numbers) {
  json list = json::array();
  for (const double number : numbers) list.push_back(OrNull(number));
  return list;
}

bool IsShare(const StyleMeasureInfo& info) { return info.key.ends_with("_ratio"); }
bool IsSmall(const StyleMeasureInfo& info) { return info.unit == "m"; }

std::string Value(const StyleMeasureInfo& info, const StyleSpread& spread) {
  if (spread.count == 0) return "-";
  std::string text = fmt::format("{:.{}f}", ForPeople(info, spread.mean), Digits(info));
  if (std::isfinite(spread.standard_error)) {
    text += fmt::format(" ± {:.{}f}", ForPeople(info, spread.standard_error), Digits(info));
  }
  return text;
}

std::string Distance(const StyleDistance& distance) {
  if (!std::isfinite(distance.distance)) return "-";
  return fmt::format("{:.2f}{}", distance.distance, distance.Shown() ? "" : " (chance)");
}

std::vector<std::string> MeanRow(const NaturalnessStudy& study, const char* label,
                                 double NaturalnessColumn::*distance,
                                 double NaturalnessColumn::*by_chance) {
  std::vector<std::string> row = {label, ""};
  for (std::size_t c = 1; c < study.columns.size(); ++c) {
    const NaturalnessColumn& column = study.columns[c];
    row.emplace_back("");
    row.push_back(fmt::format("{:.2f} (chance: {:.2f})", column.*distance, column.*by_chance));
  }
  return row;
}

std::string Label(const StyleMeasureInfo& info) {
  const std::string unit = UnitForPeople(info);
  return unit.empty() ? std::string(info.label) : fmt::format("{}, {}", info.label, unit);
}

}  // namespace

const StyleMeasureInfo& InfoOf(StyleMeasure measure) {
  return StyleMeasures()[static_cast<std::size_t>(measure)];
}
const StyleMeasureInfo& InfoOf(int measure) { return InfoOf(static_cast<StyleMeasure>(measure)); }

// As people read it: shares in %, lengths in cm.
double ForPeople(const StyleMeasureInfo& info, double value) {
  return IsShare(info) || IsSmall(info) ? 100.0 * value : value;
}
std::string UnitForPeople(const StyleMeasureInfo& info) {
  if (IsShare(info)) return "%";
  return IsSmall(info) ? "cm" : std::string(info.unit);
}
// Digits by what an eye can tell.
int Digits(const StyleMeasureInfo& info) {
  const double resolution = ForPeople(info, info.resolution);
  return resolution < 0.05 ? 3 : resolution < 0.5 ? 2 : resolution < 5.0 ? 1 : 0;
}

// "What sets X apart": its farthest measures in words.
std::string ApartText(const NaturalnessStudy& study, const NaturalnessColumn& column, int most) {
  const std::vector<StyleMeasure> apart = SetApartBy(column);
  if (apart.empty()) return "nothing beyond chance";
  std::string text;
  for (std::size_t i = 0; i < apart.size() && static_cast<int>(i) < most; ++i) {
    const auto m = static_cast<std::size_t>(apart[i]);
    const StyleMeasureInfo& info = InfoOf(apart[i]);
    text += fmt::format("{}{} ({:.{}f} for {:.{}f} {}; {:.1f})", i == 0 ? "" : ", ", info.label,
                        ForPeople(info, column.spread[m].mean), Digits(info),
                        ForPeople(info, study.columns[0].spread[m].mean), Digits(info),
                        UnitForPeople(info), column.distance[m].distance);
  }
  return text;
}

std::string Summary(const NaturalnessColumn& column) {
  return fmt::format("{}: {} motions, {} of them walks, {:.1f} min", column.set.label,
                     column.NumMotions(), column.NumWalks(), column.Minutes());
}

std::vector<std::vector<std::string>> Rows(const NaturalnessStudy& study,
                                           const std::string_view* group) {
  std::vector<std::vector<std::string>> rows;
  for (int m = 0; m < study.NumMeasures(); ++m) {
    const StyleMeasureInfo& info = InfoOf(m);
    if (group != nullptr && info.group != *group) continue;
    std::vector<std::string> row = {Label(info)};
    for (std::size_t c = 0; c < study.columns.size(); ++c) {
      row.push_back(Value(info, study.columns[c].spread[static_cast<std::size_t>(m)]));
      if (c > 0) row.push_back(Distance(study.columns[c].distance[static_cast<std::size_t>(m)]));
    }
    rows.push_back(std::move(row));
  }
  if (study.columns.size() < 2 || group != nullptr) return rows;
  rows.push_back(MeanRow(study, "mean over measures, each at most 5",
                         &NaturalnessColumn::mean_distance, &NaturalnessColumn::mean_by_chance));
  if (study.hands) {
    rows.back()[0] = "mean over measures but the hand's, each at most 5";
    rows.push_back(MeanRow(study, "mean over the hand's", &NaturalnessColumn::hand_distance,
                           &NaturalnessColumn::hand_by_chance));
  }
  return rows;
}

std::vector<std::string> Heads(const NaturalnessStudy& study) {
  std::vector<std::string> heads = {"measure"};
  for (std::size_t c = 0; c < study.columns.size(); ++c) {
    heads.push_back(study.columns[c].set.label);
    if (c > 0) heads.emplace_back("distance");
  }
  return heads;
}

double CurveX(const StyleCurveInfo& info, Eigen::Index i) {
  // Spectra are sampled, all else is in bins.
  const double place = static_cast<double>(i) + (info.key == "power" ? 0.0 : 0.5);
  return info.begin + place * info.step;
}

std::string NaturalnessTable(const NaturalnessStudy& study) {
  std::string text;
  for (const NaturalnessColumn& column : study.columns) text += Summary(column) + "\n";
  text += "\n" + MarkdownTable(Heads(study), Rows(study), true);
  text += "\n";
  for (const NaturalnessColumn& column : study.columns) {
    const double share = 100.0 / column.NumMotions();
    text += fmt::format(
        "{}: {:.1f} % crouch twice on the way, {:.1f} % lean back by more than 10 "
        "degrees while waiting\n",
        column.set.label, share * column.NumCrouchingTwice(), share * column.NumLeaningBack());
  }
  const double captured_m = study.columns[0].pair_distance_m;
  for (const NaturalnessColumn& column : study.columns) {
    if (!std::isfinite(column.pair_distance_m)) continue;
    text += fmt::format("{}: joints of two motions are {:.1f} cm apart on average",
                        column.set.label, 100.0 * column.pair_distance_m);
    text += &column == study.columns.data() || !(captured_m > 0.0)
                ? "\n"
                : fmt::format(", {:.2f} of {}\n", column.pair_distance_m / captured_m,
                              study.columns[0].set.label);
  }
  for (std::size_t c = 1; c < study.columns.size(); ++c) {
    text += fmt::format("\nWhat sets {} apart: {}.\n", study.columns[c].set.label,
                        ApartText(study, study.columns[c], 6));
  }
  return text;
}

json NaturalnessJson(const NaturalnessStudy& study) {
  json results;
  results["notes"] = study.notes;
  for (const NaturalnessColumn& column : study.columns) {
    const bool reference = &column == study.columns.data();
    json set = {{"label", column.set.label},
                {"motions", column.NumMotions()},
                {"walks", column.NumWalks()},
                {"minutes", column.Minutes()},
                {"crouch_twice", column.NumCrouchingTwice()},
                {"lean_back", column.NumLeaningBack()},
                {"pair_distance_m", OrNull(column.pair_distance_m)},
                {"mean_distance", reference ? json() : OrNull(column.mean_distance)},
                {"mean_distance_by_chance", reference ? json() : OrNull(column.mean_by_chance)}};
    if (study.hands && !reference) {
      set["hand_distance"] = OrNull(column.hand_distance);
      set["hand_distance_by_chance"] = OrNull(column.hand_by_chance);
    }
    if (!reference) {
      set["set_apart_by"] = json::array();
      for (const StyleMeasure measure : SetApartBy(column)) {
        set["set_apart_by"].push_back(InfoOf(measure).key);
      }
    }
    for (const int i : OddestMotions(column, 5)) {
      const Oddness& odd = column.oddness[static_cast<std::size_t>(i)];
      set["oddest"].push_back({{"motion", column.files[static_cast<std::size_t>(i)]},
                               {"oddness", odd.value},
                               {"farthest_off", InfoOf(odd.most).key},
                               {"value", odd.most_value}});
    }
    results["sets"].push_back(std::move(set));
  }
  for (int m = 0; m < study.NumMeasures(); ++m) {
    const StyleMeasureInfo& info = InfoOf(m);
    json measure = {{"key", info.key},
                    {"label", info.label},
                    {"group", info.group},
                    {"unit", info.unit},
                    {"of_walks", info.of_walks},
                    {"resolution", info.resolution},
                    {"definition", info.definition}};
    for (const NaturalnessColumn& column : study.columns) {
      json value = SpreadJson(column.spread[static_cast<std::size_t>(m)]);
      if (&column != study.columns.data()) {
        const StyleDistance& distance = column.distance[static_cast<std::size_t>(m)];
        value["ratio"] = OrNull(distance.ratio);
        value["cohens_d"] = OrNull(distance.cohens_d);
        value["distance"] = OrNull(distance.distance);
        value["distance_by_chance"] = OrNull(distance.by_chance);
      }
      measure["sets"].push_back(std::move(value));
    }
    results["measures"].push_back(std::move(measure));
  }
  for (int k = 0; k < study.NumCurves(); ++k) {
    const StyleCurveInfo& info = StyleCurves()[static_cast<std::size_t>(k)];
    json curve = {{"label", info.label}, {"x_label", info.x_label}, {"y_label", info.y_label}};
    for (int i = 0; i < info.points; ++i) curve["x"].push_back(CurveX(info, i));
    for (const NaturalnessColumn& column : study.columns) {
      const StyleCurveSpread spread = SpreadOf(column.set, static_cast<StyleCurve>(k));
      curve["sets"].push_back({{"motions", spread.count},
                               {"mean", NumbersJson(spread.mean)},
                               {"lower_quartile", NumbersJson(spread.low)},
                               {"median", NumbersJson(spread.median)},
                               {"upper_quartile", NumbersJson(spread.high)}});
    }
    results["curves"][std::string(info.key)] = std::move(curve);
  }
  return results;
}

std::string NaturalnessCsv(const NaturalnessStudy& study) {
  std::string csv = "set,motion,frames,way_m,oddness,crouches_twice,lean_back_rad";
  for (int m = 0; m < study.NumMeasures(); ++m) csv += fmt::format(",{}", InfoOf(m).key);
  csv += "\n";
  const auto quoted = [](std::string text) {
    for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) {
      text.insert(at, 1, '"');
    }
    return "\"" + text + "\"";
  };
  for (const NaturalnessColumn& column : study.columns) {
    for (std::size_t i = 0; i < column.files.size(); ++i) {
      const MotionStyle& motion = column.set.motions[i];
      csv += fmt::format("{},{},{},{:.4f},{:.4f},{}", quoted(column.set.label),
                         quoted(column.files[i]), motion.frames, motion.way_m,
                         column.oddness[i].value, motion.faults.CrouchesTwice() ? 1 : 0);
      const double lean = motion.faults.lean_back_rad;
      csv += std::isfinite(lean) ? fmt::format(",{:.4f}", lean) : ",";
      for (int m = 0; m < study.NumMeasures(); ++m) {
        const double value = motion[static_cast<StyleMeasure>(m)];
        csv += std::isfinite(value) ? fmt::format(",{:.6g}", value) : ",";
      }
      csv += "\n";
    }
  }
  return csv;
}

}  // namespace holdfast::apps
