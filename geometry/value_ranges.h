// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Core>

namespace holdfast {

/// Ranges of the numbers that come in from files, whatever the format. They are far beyond any
/// human motion, and keep squares and counts that are made of them finite.
inline constexpr double kMaxMeters = 1e5;
inline constexpr double kMaxRadians = 1e3;
inline constexpr double kMaxBeta = 1e3;
inline constexpr double kLowestFrameRate = 1.0;  // Hz
inline constexpr double kHighestFrameRate = 1e4;

/// What is said of positions and angles beyond them.
inline constexpr std::string_view kMetersRemedy =
    "Positions are meters, within 100,000: check the units";
inline constexpr std::string_view kRadiansRemedy =
    "Angles are radians, within 1,000: check the units";

inline bool IsWithin(double value, double most) { return value >= -most && value <= most; }

/// Throws Error ("where[field]", with value and column) for the first number beyond +-`most` or no
/// number. `column_is`: what a column is, "frame". RequireInRange of clips, motions and meshes
/// stands beside those types; readers call it, and so should who fills them by other means.
void RequireWithin(const Eigen::Ref<const Eigen::MatrixXd>& values, double most,
                   std::string_view where, std::string_view field, std::string_view column_is,
                   std::string_view remedy);
void RequireFrameRate(double rate, std::string_view where);

/// Place of the first value that is no number or beyond +-`most`; nothing when there is none. Runs
/// at the speed of memory.
std::optional<std::size_t> FirstBeyond(std::span<const float> values, double most);
std::optional<std::size_t> FirstBeyond(std::span<const double> values, double most);

}  // namespace holdfast
