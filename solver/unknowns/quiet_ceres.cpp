// SPDX-License-Identifier: MIT
#include "solver/unknowns/quiet_ceres.h"

#include <cstdlib>
#include <string_view>

#include <unistd.h>

#if __has_include(<glog/logging.h>)
#include <glog/logging.h>
#define HOLDFAST_HAS_GLOG
#endif

namespace holdfast {
namespace {

[[noreturn]] void Fail() {
  constexpr std::string_view kText =
      "holdfast: the optimizer met numbers that it cannot work with. Check the units of the input "
      "('holdfast doctor FILE' looks at it).\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kText.data(), kText.size());
  std::_Exit(1);
}

}  // namespace

void QuietCeres() {
#ifdef HOLDFAST_HAS_GLOG
  FLAGS_minloglevel = google::NUM_SEVERITIES;
  google::InstallFailureFunction(&Fail);
#endif
}

}  // namespace holdfast
