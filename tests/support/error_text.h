// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "geometry/error.h"

namespace holdfast::testing {

/// What the Error says that `run` throws; "no error" where it throws none.
template <typename Run>
std::string ErrorText(const Run& run) {
  try {
    run();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace holdfast::testing
