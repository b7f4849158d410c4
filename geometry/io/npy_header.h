// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "geometry/io/npz.h"

namespace holdfast {

/// Reads the header of a `.npy` member: a Python dictionary literal of three known entries, parsed
/// and never evaluated. Returns the array without its data. Throws Error, named `where`, for
/// anything else, and for element types that hold no real numbers or text.
NpyArray ParseNpyHeader(std::string_view text, const std::string& where);

/// An array as the bytes of a `.npy` file, version 1.
std::string EncodeNpy(const NpyArray& array);

inline constexpr std::string_view kNpyMagic("\x93NUMPY", 6);

}  // namespace holdfast
