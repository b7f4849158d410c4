// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/asset/gltf_container.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/gltf/asset/gltf_asset.h"

namespace holdfast {
namespace {

constexpr std::string_view kMagic = "glTF";
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;
constexpr std::string_view kFetchAgain = "Fetch or export the file again";
constexpr std::string_view kKeepTogether =
    "Keep the .bin file beside the .gltf under the name it gives, or export a .glb";

// Value of a base64 digit; -1 for any other character.
int Base64Digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+' || c == '-') return 62;
  if (c == '/' || c == '_') return 63;
  return -1;
}

std::string DecodeBase64(std::string_view text, const std::string& where) {
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    const int digit = Base64Digit(c);
    if (digit < 0) throw Error(where, "its data: URI is not base64", kFetchAgain);
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    held += 6;
    if (held >= 8) {
      held -= 8;
      bytes.push_back(static_cast<char>(bits >> held & 0xFF));
    }
  }
  return bytes;
}

// Decodes "%20" and similar.
std::string DecodePercent(std::string_view text, const std::string& where) {
  const auto hex = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
  };
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      plain.push_back(text[i]);
      continue;
    }
    const int high = i + 2 < text.size() ? hex(text[i + 1]) : -1;
    const int low = high >= 0 ? hex(text[i + 2]) : -1;
    // A name may contain a literal percent sign.
    if (low < 0) {
      plain.push_back('%');
      continue;
    }
    plain.push_back(static_cast<char>(16 * high + low));
    i += 2;
  }
  if (plain.find('\0') != std::string::npos) {
    throw Error(where, "its file name holds a zero byte", kKeepTogether);
  }
  return plain;
}

bool IsAddress(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  return colon != std::string_view::npos && uri.substr(0, colon).find('/') == uri.npos;
}

std::filesystem::path InsideFolder(const std::string& name, const std::filesystem::path& folder,
                                   const std::string& where) {
  namespace fs = std::filesystem;
  const fs::path relative(name);
  const bool climbs = std::any_of(relative.begin(), relative.end(),
                                  [](const fs::path& part) { return part == ".."; });
  if (name.empty() || relative.is_absolute() || climbs || name.find('\\') != name.npos) {
    throw Error(where, fmt::format("its file '{}' is not in the folder of the glTF", name),
                kKeepTogether);
  }
  std::error_code error;
  const fs::path base = fs::canonical(folder.empty() ? fs::path(".") : folder, error);
  const fs::path target = error ? fs::path() : fs::canonical(base / relative, error);
  if (error || !fs::is_regular_file(target, error)) {
    throw Error(where, fmt::format("its file '{}' was not found", name), kKeepTogether);
  }
  // A link may point anywhere.
  const auto [end, rest] = std::mismatch(base.begin(), base.end(), target.begin(), target.end());
  if (end != base.end()) {
    throw Error(where, fmt::format("its file '{}' points outside the glTF's folder", name),
                kKeepTogether);
  }
  return target;
}

}  // namespace

bool LooksLikeGltf(std::string_view head) {
  if (head.starts_with(kMagic)) return true;
  const std::size_t first = head.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (first == head.npos || head[first] != '{') return false;
  constexpr std::array<std::string_view, 6> kKeys = {"\"asset\"",          "\"accessors\"",
                                                     "\"bufferViews\"",    "\"scenes\"",
                                                     "\"extensionsUsed\"", "\"animations\""};
  return std::any_of(kKeys.begin(), kKeys.end(),
                     [&](std::string_view key) { return head.find(key) != head.npos; });
}

GltfContainer SplitGltf(std::string_view bytes, const std::string& where) {
  if (!bytes.starts_with(kMagic)) return {bytes, {}};
  if (bytes.size() < 20)
    throw Error(where, "is a .glb that is cut short in its header", kFetchAgain);
  if (const std::uint64_t version = FromLittleEndian(bytes.substr(4, 4)); version != 2) {
    throw Error(where, fmt::format("is binary glTF of version {}", version), "Export glTF 2.0");
  }
  const std::uint64_t length = FromLittleEndian(bytes.substr(8, 4));
  if (length > bytes.size() || length < 20) {
    throw Error(where,
                fmt::format("is a .glb that declares {} bytes but has {}", length, bytes.size()),
                kFetchAgain);
  }
  GltfContainer parts;
  for (std::size_t at = 12; at + 8 <= length;) {
    const std::size_t size = FromLittleEndian(bytes.substr(at, 4));
    const std::uint64_t type = FromLittleEndian(bytes.substr(at + 4, 4));
    const bool first = at == 12;
    at += 8;
    if (size > length - at) {
      throw Error(where,
                  fmt::format("has a chunk of {} bytes where {} are left", size, length - at),
                  kFetchAgain);
    }
    if (first != (type == kJsonChunk)) {
      throw Error(where, "a .glb must hold exactly one JSON chunk, which comes first", kFetchAgain);
    }
    if (first) parts.json = bytes.substr(at, size);
    if (type == kBinaryChunk && parts.binary.data() == nullptr) {
      parts.binary = bytes.substr(at, size);
    }
    at += std::min<std::size_t>((size + 3) / 4 * 4, length - at);
  }
  return parts;
}

std::filesystem::path ResolveGltfUri(std::string_view uri, const std::filesystem::path& folder,
                                     const std::string& where) {
  if (uri.starts_with("data:")) return {};
  if (IsAddress(uri)) {
    throw Error(where,
                fmt::format("is an address ('{}'); nothing is downloaded", uri.substr(0, 80)),
                kKeepTogether);
  }
  return InsideFolder(DecodePercent(uri, where), folder, where);
}

std::string DecodeDataUri(std::string_view uri, const std::string& where) {
  const std::size_t comma = uri.find(',');
  if (comma == uri.npos || !uri.substr(0, comma).ends_with(";base64")) {
    throw Error(where, "its data: URI is not base64", kFetchAgain);
  }
  return DecodeBase64(uri.substr(comma + 1), where);
}

namespace {

std::size_t ComponentBytes(int component) {
  return component >= 5125 ? 4 : component >= 5122 ? 2 : 1;
}

// Locates `count` elements of `element` bytes, `stride` apart, from `offset` of a view.
const char* Locate(const GltfAsset& asset, int view_index, std::size_t offset, std::size_t count,
                   std::size_t element, std::size_t stride, const std::string& where) {
  const GltfBufferView& view = asset.views[view_index];
  if (view.compressed) {
    throw Error(where, "is compressed with EXT_meshopt_compression, which is not read",
                "Export without compression (gltf-transform copy in.glb out.glb does it)");
  }
  const std::string_view bytes = asset.BufferBytes(view.buffer);
  const bool view_fits = view.offset <= bytes.size() && view.bytes <= bytes.size() - view.offset;
  // Counts come from the file: they are not multiplied before they are known to be small.
  const bool fits = view_fits && offset <= view.bytes &&
                    (count == 0 || (element <= view.bytes - offset &&
                                    (count - 1) <= (view.bytes - offset - element) / stride));
  if (!fits) {
    throw Error(where,
                fmt::format("declares {} elements, more than its buffer of {} bytes holds", count,
                            bytes.size()),
                kFetchAgain);
  }
  return bytes.data() + view.offset + offset;
}

template <typename T>
T Load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

std::uint32_t LoadIndex(const char* at, int component) {
  switch (component) {
    case 5121:
      return Load<std::uint8_t>(at);
    case 5123:
      return Load<std::uint16_t>(at);
    default:
      return Load<std::uint32_t>(at);
  }
}

}  // namespace

GltfNumbers::GltfNumbers(const GltfAsset& asset, int index, int rows) {
  const GltfAccessor& accessor = asset.accessors[index];
  const std::string where = fmt::format("{}[accessors][{}]", asset.Where(), index);
  if (accessor.rows != rows) {
    throw Error(
        where, fmt::format("holds {} numbers per element where {} are needed", accessor.rows, rows),
        kFetchAgain);
  }
  component_ = accessor.component;
  component_bytes_ = ComponentBytes(component_);
  element_ = component_bytes_ * static_cast<std::size_t>(rows);
  normalized_ = accessor.normalized;
  count_ = accessor.count;
  if (accessor.view >= 0) {
    const std::size_t stride = asset.views[accessor.view].stride;
    stride_ = stride > 0 ? stride : element_;
    dense_ = Locate(asset, accessor.view, accessor.offset, count_, element_, stride_, where);
  }
  // Zeros take no bytes in a file, but reading through them takes time.
  if (accessor.view < 0 && count_ > asset.NumBytes()) {
    throw Error(where, fmt::format("declares {} elements but holds none", count_), kFetchAgain);
  }
  if (accessor.sparse_count == 0) return;
  sparse_count_ = accessor.sparse_count;
  index_component_ = accessor.sparse_index_component;
  if (index_component_ != 5121 && index_component_ != 5123 && index_component_ != 5125) {
    throw Error(where, "has sparse indices that are not unsigned integers", kFetchAgain);
  }
  const std::size_t index_bytes = ComponentBytes(index_component_);
  sparse_indices_ = Locate(asset, accessor.sparse_index_view, accessor.sparse_index_offset,
                           sparse_count_, index_bytes, index_bytes, where);
  sparse_values_ = Locate(asset, accessor.sparse_value_view, accessor.sparse_value_offset,
                          sparse_count_, element_, element_, where);
  std::uint32_t previous = 0;
  for (std::size_t k = 0; k < sparse_count_; ++k) {
    const std::uint32_t at = LoadIndex(sparse_indices_ + k * index_bytes, index_component_);
    if (at >= count_ || (k > 0 && at <= previous)) {
      throw Error(where, "has sparse indices out of range or out of order", kFetchAgain);
    }
    previous = at;
  }
}

double GltfNumbers::Decode(const char* at) const {
  // Normalized integers are fractions by glTF 2.0, section 3.11.
  switch (component_) {
    case 5120: {
      const double value = Load<std::int8_t>(at);
      return normalized_ ? std::max(value / 127, -1.0) : value;
    }
    case 5121: {
      const double value = Load<std::uint8_t>(at);
      return normalized_ ? value / 255 : value;
    }
    case 5122: {
      const double value = Load<std::int16_t>(at);
      return normalized_ ? std::max(value / 32767, -1.0) : value;
    }
    case 5123: {
      const double value = Load<std::uint16_t>(at);
      return normalized_ ? value / 65535 : value;
    }
    case 5125:
      return Load<std::uint32_t>(at);
    default:
      return static_cast<double>(Load<float>(at));
  }
}

double GltfNumbers::operator()(std::size_t i, int row) const {
  const std::size_t inner = static_cast<std::size_t>(row) * component_bytes_;
  if (sparse_count_ > 0) {
    const std::size_t bytes = ComponentBytes(index_component_);
    std::size_t low = 0, high = sparse_count_;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (LoadIndex(sparse_indices_ + middle * bytes, index_component_) < i) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    if (low < sparse_count_ && LoadIndex(sparse_indices_ + low * bytes, index_component_) == i) {
      return Decode(sparse_values_ + low * element_ + inner);
    }
  }
  return dense_ == nullptr ? 0.0 : Decode(dense_ + i * stride_ + inner);
}

}  // namespace holdfast
