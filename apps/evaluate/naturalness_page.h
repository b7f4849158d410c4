// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "generator/walk_statistics/naturalness.h"

namespace holdfast::apps {

std::string NaturalnessTable(const NaturalnessStudy& study);  ///< Markdown
nlohmann::json NaturalnessJson(const NaturalnessStudy& study);
std::string NaturalnessCsv(const NaturalnessStudy& study);  ///< one line per motion
std::string NaturalnessPage(const NaturalnessStudy& study);

const StyleMeasureInfo& InfoOf(StyleMeasure measure);
const StyleMeasureInfo& InfoOf(int measure);

/// A value as people read it: shares in %, lengths in cm; with its unit and as many digits as an
/// eye can tell.
double ForPeople(const StyleMeasureInfo& info, double value);
std::string UnitForPeople(const StyleMeasureInfo& info);
int Digits(const StyleMeasureInfo& info);

/// "reach: 60 motions, 55 of them walks, 6.2 min".
std::string Summary(const NaturalnessColumn& column);
/// What sets a column apart most, in words: up to `most` measures.
std::string ApartText(const NaturalnessStudy& study, const NaturalnessColumn& column, int most);

/// The table: one head per column; rows of one group, or of all with the mean distance below.
std::vector<std::string> Heads(const NaturalnessStudy& study);
std::vector<std::vector<std::string>> Rows(const NaturalnessStudy& study,
                                           const std::string_view* group = nullptr);

/// Where point i of a curve is.
double CurveX(const StyleCurveInfo& info, Eigen::Index i);

}  // namespace holdfast::apps
