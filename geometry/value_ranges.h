// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Core>

namespace holdfast {

/// Ranges of numbers read from files of any format. They far exceed any human motion, and keep
/// derived squares and counts finite.
inline constexpr double kMaxMeters = 1e5;
inline constexpr double kMaxRadians = 1e3;
inline constexpr double kMaxBeta = 1e3;
inline constexpr double kLowestFrameRate = 1.0;  // Hz
inline constexpr double kHighestFrameRate = 1e4;

/// Remedies for positions and angles out of range.
inline constexpr std::string_view kMetersRemedy =
    "Positions are meters, within 100,000: check the units";
inline constexpr std::string_view kRadiansRemedy =
    "Angles are radians, within 1,000: check the units";

inline bool IsWithin(double value, double most) { return value >= -most && value <= most; }

/// Throws Error ("where[field]", with value and column) for the first number that is NaN or beyond
/// +-`most`. `column_is`: the meaning of a column, "frame". RequireInRange of clips, motions and
/// meshes is declared with those types; readers call it, and so should other code that fills them.
void RequireWithin(const Eigen::Ref<const Eigen::MatrixXd>& values, double most,
                   std::string_view where, std::string_view field, std::string_view column_is,
                   std::string_view remedy);
void RequireFrameRate(double rate, std::string_view where);

/// Returns the index of the first value that is NaN or beyond +-`most`, if any. Runs at memory
/// speed.
std::optional<std::size_t> FirstBeyond(std::span<const float> values, double most);
std::optional<std::size_t> FirstBeyond(std::span<const double> values, double most);

}  // namespace holdfast
