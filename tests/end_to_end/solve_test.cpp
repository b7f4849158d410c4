// SPDX-License-Identifier: MIT
// `solve` through the program, on recordings of people.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "tests/support/data_folder.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::RunHoldfast;

TEST(SolveCommand, SolvesSomeoneWhoDrinks) {
  const std::filesystem::path data = testing::DataFolder() / "adl" / "ADL009";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no recordings in " << data;
  const testing::TemporaryFolder folder;
  const ProgramResult result = RunHoldfast(
      folder.Path(), "solve '" + (data / "ADL009DR1.csv.gz").string() + "' --static '" +
                         (data / "ADL009_static.csv.gz").string() + "' -o drinks --json -q");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json summary = nlohmann::json::parse(result.out);
  EXPECT_LT(summary["rms_mm"].get<double>(), 4.0);
  EXPECT_EQ(summary["world"]["up"], "z");
  EXPECT_NEAR(summary["world"]["facing_deg"].get<double>(), 0.0, 20.0);  // turned by 180 degrees
  EXPECT_THAT(summary["unmarked_joints"], Contains("left_knee"));
  const Clip clip = ReadClip(folder / "drinks/clip.npz");
  EXPECT_EQ(clip.frame_rate, 100.0);
  EXPECT_EQ(clip.NumFrames(), summary["frames"].get<int>());
}

TEST(SolveCommand, SaysWhichNamesItDoesNotKnow) {
  const testing::TemporaryFolder folder;
  std::ofstream(folder / "two.csv") << "Trajectories\n100\n,,P:RLEB,,,P:RWRX,,\n"
                                       "Frame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n"
                                       "1,0,1,2,3,40,50,60\n2,0,1,2,3,40,50,60\n";
  const ProgramResult result = RunHoldfast(folder.Path(), "solve two.csv -o out");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("two.csv: no marker's name is known; the first is 'RLEB'"));
  EXPECT_THAT(result.err, HasSubstr("--markers"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace holdfast
