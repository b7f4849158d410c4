// SPDX-License-Identifier: MIT
#include "geometry/render/contact_sheet.h"

#include <algorithm>

#include "geometry/error.h"
#include "geometry/render/label.h"

namespace holdfast {

Image ContactSheet(std::span<const Image> tiles, std::span<const std::string> labels, int columns) {
  if (tiles.empty() || columns < 1) {
    throw Error("contact sheet", "has no tiles or no columns", "Give at least one of each.");
  }
  constexpr int kGap = 2;  // white between the tiles, pixels
  int cell_width = 0;
  int cell_height = 0;
  for (const Image& tile : tiles) {
    cell_width = std::max(cell_width, tile.width);
    cell_height = std::max(cell_height, tile.height);
  }
  const int count = static_cast<int>(tiles.size());
  const int used_columns = std::min(columns, count);
  const int rows = (count + columns - 1) / columns;
  Image sheet(used_columns * (cell_width + kGap) - kGap, rows * (cell_height + kGap) - kGap);
  std::fill(sheet.rgb.begin(), sheet.rgb.end(), std::uint8_t{255});
  const int scale = std::clamp(cell_height / 160, 1, 4);
  for (int t = 0; t < count; ++t) {
    const Image& tile = tiles[t];
    const int left = t % columns * (cell_width + kGap);
    const int top = t / columns * (cell_height + kGap);
    for (int y = 0; y < tile.height; ++y) {
      std::copy_n(tile.Pixel(0, y), 3 * tile.width, sheet.Pixel(left, top + y));
    }
    if (t < static_cast<int>(labels.size())) {
      DrawLabel(sheet, left + 4 * scale, top + 4 * scale, labels[t], scale);
    }
  }
  return sheet;
}

}  // namespace holdfast
