// SPDX-License-Identifier: MIT
#include "geometry/render/image.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include <fmt/format.h>
#include <png.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast {
namespace {

// Owns the png_image of libpng's simplified API; freeing it twice is allowed.
struct PngHandle {
  png_image png{};
  PngHandle() { png.version = PNG_IMAGE_VERSION; }
  ~PngHandle() { png_image_free(&png); }
};

}  // namespace

std::string EncodePng(const Image& image) {
  if (image.width <= 0 || image.height <= 0) {
    throw Error("png", fmt::format("a picture of {} x {} pixels", image.width, image.height),
                "Render at least one pixel.");
  }
  PngHandle handle;
  handle.png.width = static_cast<png_uint_32>(image.width);
  handle.png.height = static_cast<png_uint_32>(image.height);
  handle.png.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(handle.png);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&handle.png, bytes.data(), &size, 0, image.rgb.data(), 0,
                                 nullptr)) {
    throw Error("png", handle.png.message, "");
  }
  bytes.resize(size);
  return bytes;
}

Image DecodePng(std::string_view bytes, std::string_view where) {
  PngHandle handle;
  if (!png_image_begin_read_from_memory(&handle.png, bytes.data(), bytes.size())) {
    throw Error(where, fmt::format("not a PNG picture: {}", handle.png.message), "");
  }
  handle.png.format = PNG_FORMAT_RGB;
  constexpr png_uint_32 kMaxSide = 1 << 15;  // bounds the allocation for a forged header
  if (handle.png.width > kMaxSide || handle.png.height > kMaxSide) {
    throw Error(where, fmt::format("{} x {} pixels", handle.png.width, handle.png.height),
                "Pictures up to 32768 pixels a side are read.");
  }
  Image image(static_cast<int>(handle.png.width), static_cast<int>(handle.png.height));
  const png_color black{};
  if (!png_image_finish_read(&handle.png, &black, image.rgb.data(), 0, nullptr)) {
    throw Error(where, fmt::format("damaged PNG: {}", handle.png.message), "Write it again.");
  }
  return image;
}

void WritePng(const Image& image, const std::filesystem::path& path) {
  WriteAtomically(path, EncodePng(image));
}

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

namespace {

constexpr int kColumns = 5;
constexpr int kRows = 7;
constexpr int kAdvance = kColumns + 1;

// Seven rows of five dots, top first.
constexpr std::pair<char, std::string_view> kGlyphs[] = {
    {' ', "..... ..... ..... ..... ..... ..... ....."},
    {'0', ".###. #...# #..## #.#.# ##..# #...# .###."},
    {'1', "..#.. .##.. ..#.. ..#.. ..#.. ..#.. .###."},
    {'2', ".###. #...# ....# ..##. .#... #.... #####"},
    {'3', ".###. #...# ....# ..##. ....# #...# .###."},
    {'4', "...#. ..##. .#.#. #..#. ##### ...#. ...#."},
    {'5', "##### #.... ####. ....# ....# #...# .###."},
    {'6', "..##. .#... #.... ####. #...# #...# .###."},
    {'7', "##### ....# ...#. ..#.. ..#.. .#... .#..."},
    {'8', ".###. #...# #...# .###. #...# #...# .###."},
    {'9', ".###. #...# #...# .#### ....# ...#. .##.."},
    {'A', ".###. #...# #...# ##### #...# #...# #...#"},
    {'B', "####. #...# #...# ####. #...# #...# ####."},
    {'C', ".###. #...# #.... #.... #.... #...# .###."},
    {'D', "####. #...# #...# #...# #...# #...# ####."},
    {'E', "##### #.... #.... ####. #.... #.... #####"},
    {'F', "##### #.... #.... ####. #.... #.... #...."},
    {'G', ".###. #...# #.... #.### #...# #...# .####"},
    {'H', "#...# #...# #...# ##### #...# #...# #...#"},
    {'I', ".###. ..#.. ..#.. ..#.. ..#.. ..#.. .###."},
    {'J', "..### ...#. ...#. ...#. ...#. #..#. .##.."},
    {'K', "#...# #..#. #.#.. ##... #.#.. #..#. #...#"},
    {'L', "#.... #.... #.... #.... #.... #.... #####"},
    {'M', "#...# ##.## #.#.# #.#.# #...# #...# #...#"},
    {'N', "#...# ##..# #.#.# #..## #...# #...# #...#"},
    {'O', ".###. #...# #...# #...# #...# #...# .###."},
    {'P', "####. #...# #...# ####. #.... #.... #...."},
    {'Q', ".###. #...# #...# #...# #.#.# #..#. .##.#"},
    {'R', "####. #...# #...# ####. #.#.. #..#. #...#"},
    {'S', ".#### #.... #.... .###. ....# ....# ####."},
    {'T', "##### ..#.. ..#.. ..#.. ..#.. ..#.. ..#.."},
    {'U', "#...# #...# #...# #...# #...# #...# .###."},
    {'V', "#...# #...# #...# #...# #...# .#.#. ..#.."},
    {'W', "#...# #...# #...# #.#.# #.#.# ##.## #...#"},
    {'X', "#...# #...# .#.#. ..#.. .#.#. #...# #...#"},
    {'Y', "#...# #...# .#.#. ..#.. ..#.. ..#.. ..#.."},
    {'Z', "##### ....# ...#. ..#.. .#... #.... #####"},
    {'.', "..... ..... ..... ..... ..... .##.. .##.."},
    {',', "..... ..... ..... ..... .##.. ..#.. .#..."},
    {':', "..... .##.. .##.. ..... .##.. .##.. ....."},
    {';', "..... .##.. .##.. ..... .##.. ..#.. .#..."},
    {'-', "..... ..... ..... ##### ..... ..... ....."},
    {'+', "..... ..#.. ..#.. ##### ..#.. ..#.. ....."},
    {'/', "....# ....# ...#. ..#.. .#... #.... #...."},
    {'_', "..... ..... ..... ..... ..... ..... #####"},
    {'=', "..... ..... ##### ..... ##### ..... ....."},
    {'%', "##..# ##..# ...#. ..#.. .#... #..## #..##"},
    {'(', "...#. ..#.. .#... .#... .#... ..#.. ...#."},
    {')', ".#... ..#.. ...#. ...#. ...#. ..#.. .#..."},
    {'#', ".#.#. .#.#. ##### .#.#. ##### .#.#. .#.#."},
    {'<', "...#. ..#.. .#... #.... .#... ..#.. ...#."},
    {'>', ".#... ..#.. ...#. ....# ...#. ..#.. .#..."},
    {'*', "..... ..#.. #.#.# .###. #.#.# ..#.. ....."},
    {'\'', "..#.. ..#.. .#... ..... ..... ..... ....."},
};
constexpr std::string_view kUnknown = "##### #...# #...# #...# #...# #...# #####";

std::string_view Rows(char character) {
  const char capital = static_cast<char>(std::toupper(static_cast<unsigned char>(character)));
  for (const auto& [known, rows] : kGlyphs) {
    if (known == capital) return rows;
  }
  return kUnknown;
}

}  // namespace

void DrawLabel(Image& image, int x, int y, std::string_view text, int scale) {
  constexpr std::uint8_t kGray = 40;
  for (const char character : text) {
    const std::string_view rows = Rows(character);
    for (int py = 0; py < kRows * scale; ++py) {
      for (int px = 0; px < kColumns * scale; ++px) {
        if (rows[static_cast<std::size_t>(py / scale * kAdvance + px / scale)] != '#') continue;
        if (x + px < 0 || x + px >= image.width || y + py < 0 || y + py >= image.height) continue;
        std::uint8_t* const pixel = image.Pixel(x + px, y + py);
        pixel[0] = pixel[1] = pixel[2] = kGray;
      }
    }
    x += kAdvance * scale;
  }
}

}  // namespace holdfast
