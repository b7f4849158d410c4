// SPDX-License-Identifier: MIT
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/inspect/inspection.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;

// A recording of four frames of three markers, b with a gap, c never seen.
std::string ViconText(const char* unit, double jump) {
  std::string text =
      "\xEF\xBB\xBFTrajectories\n100\n,,P:a,,,P:b,,,P:c,,\nFrame,Sub Frame,X,Y,Z\n,,";
  for (int k = 0; k < 9; ++k) text += std::string(unit) + ",";
  text += "\n";
  for (int t = 1; t <= 4; ++t) {
    const double x = 1000.0 + (t == 3 ? jump : 0.0);
    text += std::to_string(t) + ",0," + std::to_string(x) + ",0,0," +
            (t == 2 ? std::string(",,") : std::string("0,0,900")) + ",,,\n";
  }
  return text;
}

std::string MarkerFindings(const Inspection& inspection) {
  std::string all;
  for (const Finding& finding : inspection.findings) all += finding.text + "\n";
  return all;
}

class InspectMarkersTest : public ::testing::Test {
 protected:
  Inspection Look(const std::string& text) {
    std::ofstream(folder_ / "walk.csv") << text;
    return Inspect(folder_ / "walk.csv");
  }
  const testing::TemporaryFolder folder_;
};

TEST_F(InspectMarkersTest, TellsNamesGapsAndJumps) {
  const Inspection still = Look(ViconText("mm", 0.0));
  EXPECT_EQ(still.title, "marker recording: Vicon CSV");
  EXPECT_EQ(still.Worst(), Verdict::kWarning);
  EXPECT_THAT(MarkerFindings(still), HasSubstr("never seen: c"));
  EXPECT_THAT(MarkerFindings(still), HasSubstr("b 1 frames (longest gap 1)"));
  EXPECT_THAT(MarkerFindings(still), ::testing::Not(HasSubstr("accelerations")));
  EXPECT_THAT(MarkerFindings(Look(ViconText("mm", 40.0))), HasSubstr("accelerations over 200"));
}

TEST_F(InspectMarkersTest, DoubtsUnitsThatMakeAGiant) {
  const Inspection meters = Look(ViconText("m", 0.0));
  EXPECT_EQ(meters.Worst(), Verdict::kFault);
  EXPECT_THAT(MarkerFindings(meters), HasSubstr("the unit is not m"));
}

TEST_F(InspectMarkersTest, FaultsNameTheLine) {
  const Inspection broken = Look(ViconText("mm", 0.0) + "5,0,1,2\n");
  EXPECT_EQ(broken.Worst(), Verdict::kFault);
  EXPECT_THAT(MarkerFindings(broken), HasSubstr("walk.csv:10"));
}

}  // namespace
}  // namespace holdfast
