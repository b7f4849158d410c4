// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/clip.h"
#include "geometry/io/npz.h"

namespace holdfast {

/// The arrays that WriteClip writes, added to a file that holds more than a clip.
void AddArrays(const Clip& clip, NpzWriter& writer);

}  // namespace holdfast
