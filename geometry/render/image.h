// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// An 8-bit sRGB picture: three bytes per pixel, rows from the top, no padding.
struct Image {
  Image() = default;
  Image(int image_width, int image_height)
      : width(image_width),
        height(image_height),
        rgb(3 * static_cast<std::size_t>(image_width) * static_cast<std::size_t>(image_height)) {}

  std::uint8_t* Pixel(int x, int y) { return rgb.data() + Offset(x, y); }
  const std::uint8_t* Pixel(int x, int y) const { return rgb.data() + Offset(x, y); }

  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;

 private:
  std::size_t Offset(int x, int y) const {
    return 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                static_cast<std::size_t>(x));
  }
};

/// Encodes a picture as PNG. The bytes are deterministic. Throws Error for an empty picture.
std::string EncodePng(const Image& image);

/// Decodes a PNG. Gray, palette and alpha pictures are converted to RGB over black. `where` names
/// the source in messages. Throws Error for anything that is not a complete PNG.
Image DecodePng(std::string_view bytes, std::string_view where = "png");

/// EncodePng to a file, atomically.
void WritePng(const Image& image, const std::filesystem::path& path);

/// Tiles pictures row by row, `columns` per row, each with its label in the corner (there may be
/// fewer labels than tiles). Every cell has the size of the largest tile; the rest stays white.
/// Throws Error for no tiles or fewer than one column.
Image ContactSheet(std::span<const Image> tiles, std::span<const std::string> labels, int columns);

/// Draws a line of text with its top left corner at (x, y), in capitals of a built-in 5 x 7 font
/// whose dots are `scale` pixels wide. Supports letters, digits, space and .,:;-+/_=%()#<>*'; other
/// characters are drawn as a box. Clipped to the picture.
void DrawLabel(Image& image, int x, int y, std::string_view text, int scale = 1);

}  // namespace holdfast
