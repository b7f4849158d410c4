// SPDX-License-Identifier: MIT
#include "apps/evaluate/naturalness_text.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace holdfast::apps {
namespace {

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

int NaturalnessColumn::NumWalks() const {
  return static_cast<int>(std::ranges::count_if(
      set.motions, [&](const MotionStyle& motion) { return motion.way_m >= set.least_way_m; }));
}

double NaturalnessColumn::Minutes() const {
  double frames = 0.0;
  for (const MotionStyle& motion : set.motions) frames += motion.frames;
  return frames / 30.0 / 60.0;
}

std::vector<StyleMeasure> SetApartBy(const NaturalnessColumn& column) {
  std::vector<std::pair<double, int>> order;
  for (int m = 0; m < kNumStyleMeasures; ++m) {
    const StyleDistance& distance = column.distance[static_cast<std::size_t>(m)];
    if (distance.Shown()) order.emplace_back(-distance.distance, m);
  }
  std::ranges::sort(order);
  std::vector<StyleMeasure> measures;
  for (const auto& [distance, m] : order) measures.push_back(static_cast<StyleMeasure>(m));
  return measures;
}

std::vector<int> OddestMotions(const NaturalnessColumn& column, int count) {
  std::vector<int> order;
  for (int i = 0; i < column.NumMotions(); ++i) {
    if (std::isfinite(column.oddness[static_cast<std::size_t>(i)].value)) order.push_back(i);
  }
  std::ranges::stable_sort(order, [&](int a, int b) {
    return column.oddness[static_cast<std::size_t>(a)].value >
           column.oddness[static_cast<std::size_t>(b)].value;
  });
  if (static_cast<int>(order.size()) > count) order.resize(static_cast<std::size_t>(count));
  return order;
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
  for (int m = 0; m < kNumStyleMeasures; ++m) {
    const StyleMeasureInfo& info = InfoOf(m);
    if (group != nullptr && info.group != *group) continue;
    std::vector<std::string> row = {Label(info)};
    for (std::size_t c = 0; c < study.columns.size(); ++c) {
      row.push_back(Value(info, study.columns[c].spread[static_cast<std::size_t>(m)]));
      if (c > 0) row.push_back(Distance(study.columns[c].distance[static_cast<std::size_t>(m)]));
    }
    rows.push_back(std::move(row));
  }
  std::vector<std::string> last = {"mean over measures, each at most 5"};
  for (std::size_t c = 0; c < study.columns.size(); ++c) {
    last.emplace_back("");
    if (c > 0) {
      last.push_back(fmt::format("{:.2f} (chance: {:.2f})", study.columns[c].mean_distance,
                                 study.columns[c].mean_by_chance));
    }
  }
  if (study.columns.size() > 1 && group == nullptr) rows.push_back(std::move(last));
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
  text += "\n|";
  const std::vector<std::string> heads = Heads(study);
  for (const std::string& head : heads) text += fmt::format(" {} |", head);
  text += "\n|---|";
  for (std::size_t k = 1; k < heads.size(); ++k) text += "---:|";
  text += "\n";
  for (const std::vector<std::string>& row : Rows(study)) {
    text += "|";
    for (const std::string& cell : row) text += fmt::format(" {} |", cell);
    text += "\n";
  }
  for (std::size_t c = 1; c < study.columns.size(); ++c) {
    text += fmt::format("\nWhat sets {} apart: {}.\n", study.columns[c].set.label,
                        ApartText(study, study.columns[c], 6));
  }
  return text;
}

}  // namespace holdfast::apps
