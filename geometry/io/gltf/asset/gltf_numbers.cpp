// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/gltf/asset/gltf_asset.h"
#include "geometry/io/gltf/asset/gltf_container.h"

namespace holdfast {
namespace {

std::size_t ComponentBytes(int component) {
  return component >= 5125 ? 4 : component >= 5122 ? 2 : 1;
}

// `count` elements of `element` bytes, `stride` apart, from `offset` of a view.
const char* Locate(const GltfAsset& asset, int view_index, std::size_t offset, std::size_t count,
                   std::size_t element, std::size_t stride, const std::string& where) {
  const GltfBufferView& view = asset.views[static_cast<std::size_t>(view_index)];
  if (view.compressed) {
    throw Error(where, "is compressed with EXT_meshopt_compression, which is not read",
                "Export without compression (gltf-transform copy in.glb out.glb does it)");
  }
  const std::string_view bytes = asset.BufferBytes(view.buffer);
  const bool view_fits = view.offset <= bytes.size() && view.bytes <= bytes.size() - view.offset;
  // Counts come from the file: no product of theirs is formed before it is known to be small.
  const bool fits = view_fits && offset <= view.bytes &&
                    (count == 0 || (element <= view.bytes - offset &&
                                    (count - 1) <= (view.bytes - offset - element) / stride));
  if (!fits) {
    throw Error(where,
                fmt::format("tells of {} elements, which its buffer of {} bytes does not hold",
                            count, bytes.size()),
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
  const GltfAccessor& accessor = asset.accessors[static_cast<std::size_t>(index)];
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
    const std::size_t stride = asset.views[static_cast<std::size_t>(accessor.view)].stride;
    stride_ = stride > 0 ? stride : element_;
    dense_ = Locate(asset, accessor.view, accessor.offset, count_, element_, stride_, where);
  }
  // Zeros cost a file nothing, going through them does.
  if (accessor.view < 0 && count_ > asset.NumBytes()) {
    throw Error(where, fmt::format("tells of {} elements and holds none", count_), kFetchAgain);
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
  // Normalised integers: the fractions of glTF 2.0, section 3.11.
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
