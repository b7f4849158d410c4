// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "geometry/clip.h"
#include "geometry/io/motion_file.h"
#include "geometry/mesh.h"

namespace holdfast {

/// Ranges of the numbers that come in from files, whatever the format. They are far beyond any
/// human motion, and keep squares and counts that are made of them finite.
inline constexpr double kMostMetres = 1e5;
inline constexpr double kMostRadians = 1e3;
inline constexpr double kMostBeta = 1e3;
inline constexpr double kLowestFrameRate = 1.0;  // Hz
inline constexpr double kHighestFrameRate = 1e4;

/// Each throws Error (`where`, with the field or element and the frame) for the first number that
/// is outside its range or no number. Readers call them; so should who fills these by other means.
void RequireInRange(const Clip& clip, std::string_view where);
void RequireInRange(const SourceMotion& motion, std::string_view where);
void RequireInRange(const TriangleMesh& mesh, std::string_view where);

/// Place of the first value that is no number or beyond +-`most`; nothing when there is none. Runs
/// at the speed of memory.
std::optional<std::size_t> FirstBeyond(std::span<const float> values, double most);
std::optional<std::size_t> FirstBeyond(std::span<const double> values, double most);

}  // namespace holdfast
