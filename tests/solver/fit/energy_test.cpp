// SPDX-License-Identifier: MIT
#include "solver/fit/fit_options.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

TEST(EnergyTerms, StandInTheOrderOfTheirEnum) {
  std::set<std::string> names;
  std::set<double FitOptions::*, bool (*)(double FitOptions::*, double FitOptions::*)> weights(
      [](double FitOptions::*a, double FitOptions::*b) {
        static const FitOptions options;
        return &(options.*a) < &(options.*b);
      });
  int k = 0;
  for (const EnergyTermInfo& info : EnergyTerms()) {
    EXPECT_EQ(static_cast<int>(info.term), k) << info.name;
    EXPECT_EQ(info.metric != nullptr, k < kNumReportedEnergies) << info.name;
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_TRUE(weights.insert(info.weight).second) << info.name;
    ++k;
  }
  EXPECT_EQ(EnergyTerms().back().term, EnergyTerm::kSupport);  // the last of the enum has a row
}

TEST(EnergyTerms, WeighTheirEnergies) {
  FitOptions options;
  for (int k = 0; k < kNumReportedEnergies; ++k) {
    const EnergyTermInfo& info = EnergyTerms()[k];
    Energies energies;
    energies[info.term] = 2.0;
    energies += energies;
    options.*info.weight = 3.0 + k;
    EXPECT_DOUBLE_EQ(energies.Total(options), 4.0 * (3.0 + k)) << info.name;
  }
}

TEST(EnergyTerms, OnlyPaperLeavesThree) {
  FitOptions all;
  all.slip = true;
  for (const EnergyTermInfo& info : EnergyTerms()) all.*info.weight = 7.0;
  const FitOptions paper = all.OnlyPaper();
  EXPECT_FALSE(paper.slip);
  double sum = 0.0;
  for (const EnergyTermInfo& info : EnergyTerms()) sum += paper.*info.weight;
  EXPECT_EQ(sum, 21.0);
  EXPECT_EQ(paper.lambda_distance + paper.lambda_contact + paper.lambda_temporal, 21.0);
}

}  // namespace
}  // namespace holdfast
