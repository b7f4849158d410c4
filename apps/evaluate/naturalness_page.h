// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "generator/walk_statistics/style_comparison.h"

namespace holdfast::apps {

/// A set of motions, measured, and how far it is from the reference.
struct NaturalnessColumn {
  StyleSet set;
  std::vector<std::string> files;  ///< of the motions
  std::array<StyleSpread, kNumStyleMeasures> spread;
  std::array<StyleDistance, kNumStyleMeasures> distance;  ///< NaN for the reference itself
  std::vector<Oddness> oddness;                           ///< of the motions
  double mean_distance = 0;                               ///< over measures, each at most kFarthest
  double mean_by_chance = 0;                              ///< of their `by_chance`

  int NumMotions() const { return static_cast<int>(set.motions.size()); }
  int NumWalks() const;
  double Minutes() const;
};
inline constexpr double kFarthest = 5.0;

/// Reference first.
struct NaturalnessStudy {
  std::vector<NaturalnessColumn> columns;
  std::vector<std::string> notes;
};

/// What tells a set from the reference, farthest first: measures beyond chance.
std::vector<StyleMeasure> SetApartBy(const NaturalnessColumn& column);
/// Motions least like the reference first.
std::vector<int> OddestMotions(const NaturalnessColumn& column, int count);

std::string NaturalnessTable(const NaturalnessStudy& study);  ///< Markdown
nlohmann::json NaturalnessJson(const NaturalnessStudy& study);
std::string NaturalnessCsv(const NaturalnessStudy& study);  ///< one line per motion
std::string NaturalnessPage(const NaturalnessStudy& study);

}  // namespace holdfast::apps
