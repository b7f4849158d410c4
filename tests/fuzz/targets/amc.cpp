// SPDX-License-Identifier: MIT
#include "geometry/io/motion/asf_amc.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/motion_checks.h"

// A motion needs its skeleton: one input is the .asf, a line of four dashes, and the .amc.
HOLDFAST_FUZZ_TARGET(amc) {
  constexpr std::string_view kBetween = "\n----\n";
  const std::string_view text = trial.Text();
  const std::size_t end = std::min(text.find(kBetween), text.size());
  const std::string_view amc = text.substr(std::min(end + kBetween.size(), text.size()));
  const holdfast::SourceMotion motion =
      holdfast::ParseAmc(text.substr(0, end), "bones.asf", amc, "motion.amc");
  trial.Accept();
  holdfast::fuzz::RequireSound(motion);
}
