// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "geometry/render/image.h"

namespace holdfast {

/// The picture as a PNG file's bytes. The same picture gives the same bytes.
/// Throws Error for an empty picture.
std::string EncodePng(const Image& image);

/// The inverse; grey, palette and alpha pictures come out as RGB over black.
/// `where` names the source in messages. Throws Error for anything that is not a whole PNG.
Image DecodePng(std::string_view bytes, std::string_view where = "png");

/// EncodePng to a file, atomically.
void WritePng(const Image& image, const std::filesystem::path& path);

}  // namespace holdfast
