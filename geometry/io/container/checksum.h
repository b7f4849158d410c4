// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "geometry/io/container/byte_source.h"

namespace holdfast {

/// FNV-1a (Fowler, Noll & Vo), 64 bits, as text.
std::string Checksum(std::string_view bytes);
/// The same of all bytes of a source.
std::string Checksum(const ByteSource& source);

}  // namespace holdfast
