// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "geometry/render/image.h"

namespace holdfast {

/// Tiles pictures row by row, `columns` per row, each with its label in the corner (there may be
/// fewer labels than tiles). Every cell has the size of the largest tile; the rest stays white.
/// Throws Error for no tiles or fewer than one column.
Image ContactSheet(std::span<const Image> tiles, std::span<const std::string> labels, int columns);

/// Draws a line of text with its top left corner at (x, y), in capitals of a built-in 5 x 7 font
/// whose dots are `scale` pixels wide. Supports letters, digits, space and .,:;-+/_=%()#<>*'; other
/// characters are drawn as a box. Clipped to the picture.
void DrawLabel(Image& image, int x, int y, std::string_view text, int scale = 1,
               std::uint8_t gray = 40);

/// Width and height of a label in pixels.
int LabelWidth(std::string_view text, int scale = 1);
int LabelHeight(int scale = 1);

}  // namespace holdfast
