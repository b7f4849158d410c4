// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
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

}  // namespace holdfast
