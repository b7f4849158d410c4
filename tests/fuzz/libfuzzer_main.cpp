// SPDX-License-Identifier: MIT
#include <cstdint>

#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace holdfast::fuzz;
  Run(Targets().front(), std::as_bytes(std::span(data, size)));
  return 0;
}
