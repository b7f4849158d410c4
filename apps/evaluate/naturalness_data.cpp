// SPDX-License-Identifier: MIT
#include <cmath>

#include <fmt/format.h>

#include "apps/evaluate/naturalness_text.h"

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

}  // namespace

json NaturalnessJson(const NaturalnessStudy& study) {
  json results;
  results["notes"] = study.notes;
  for (const NaturalnessColumn& column : study.columns) {
    const bool reference = &column == study.columns.data();
    json set = {{"label", column.set.label},
                {"motions", column.NumMotions()},
                {"walks", column.NumWalks()},
                {"minutes", column.Minutes()},
                {"mean_distance", reference ? json() : OrNull(column.mean_distance)},
                {"mean_distance_by_chance", reference ? json() : OrNull(column.mean_by_chance)}};
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
  for (int m = 0; m < kNumStyleMeasures; ++m) {
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
  for (int k = 0; k < kNumStyleCurves; ++k) {
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
  std::string csv = "set,motion,frames,way_m,oddness";
  for (const StyleMeasureInfo& info : StyleMeasures()) csv += fmt::format(",{}", info.key);
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
      csv +=
          fmt::format("{},{},{},{:.4f},{:.4f}", quoted(column.set.label), quoted(column.files[i]),
                      motion.frames, motion.way_m, column.oddness[i].value);
      for (const double value : motion.values) {
        csv += std::isfinite(value) ? fmt::format(",{:.6g}", value) : ",";
      }
      csv += "\n";
    }
  }
  return csv;
}

}  // namespace holdfast::apps
