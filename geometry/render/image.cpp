// SPDX-License-Identifier: MIT
#include "geometry/render/image.h"

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

}  // namespace holdfast
