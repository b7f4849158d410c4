// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace holdfast {

/// Instruction sets that the hot loops are compiled for; the best one is selected at run time.
enum class Isa { kScalar, kSse2, kAvx2, kAvx512 };

Isa BestIsa();
bool IsSupported(Isa isa);
std::string_view IsaName(Isa isa);

}  // namespace holdfast
