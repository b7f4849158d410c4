// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/io/byte_source.h"

namespace holdfast {

/// What a gzip'd file holds. It is unpacked twice, first only to see that it is whole and how long,
/// so that memory is taken once and for sound data alone. Throws Error when it is damaged, cut off,
/// holds nothing, or unpacks to more than `limit_bytes`.
std::vector<std::byte> ReadGzip(const ByteSource& source, std::size_t limit_bytes);

}  // namespace holdfast
