// SPDX-License-Identifier: MIT
#include "geometry/error.h"

#include <fmt/format.h>

namespace holdfast {

Error::Error(std::string_view where, std::string_view problem, std::string_view remedy)
    : std::runtime_error(remedy.empty() ? fmt::format("{}: {}", where, problem)
                                        : fmt::format("{}: {}. {}", where, problem, remedy)),
      where_(where),
      problem_(problem),
      remedy_(remedy) {}

}  // namespace holdfast
