// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>

#include "geometry/render/image.h"

namespace holdfast {

/// Tiles pictures row by row, `columns` to a row, each with its label in the corner (labels may be
/// fewer than tiles). Every cell has the size of the largest tile; the rest stays white.
/// Throws Error for no tiles or fewer than one column.
Image ContactSheet(std::span<const Image> tiles, std::span<const std::string> labels, int columns);

}  // namespace holdfast
