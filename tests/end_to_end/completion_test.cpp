// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProgramFolder;
using testing::ReadText;

class Completion : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_.Path() / "script") << folder_.Run("--bash-completion").out;
    std::ofstream(folder_.Path() / "mine.npz") << "x";
  }

  // What bash offers for these words, of which the last is being typed.
  std::string Offered(const std::string& words) {
    const std::string command = "cd '" + folder_.Path().string() +
                                "' && bash -c 'source ./script; COMP_WORDS=(" + words +
                                "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _holdfast; " +
                                "echo \" ${COMPREPLY[*]} \"' > offered 2> fault";
    EXPECT_EQ(std::system(command.c_str()), 0) << ReadText(folder_.Path() / "fault");
    EXPECT_EQ(ReadText(folder_.Path() / "fault"), "");
    return ReadText(folder_.Path() / "offered");
  }

 private:
  ProgramFolder folder_;
};

TEST_F(Completion, OffersCommandsOptionsValuesObjectsAndFiles) {
  EXPECT_EQ(Offered("holdfast re"), " render report refine reach \n");
  EXPECT_EQ(Offered("holdfast body i"), " info \n");
  EXPECT_EQ(Offered("holdfast fit --object-s"), " --object-scale \n");
  EXPECT_EQ(Offered("holdfast fit --hand b"), " both \n");
  EXPECT_EQ(Offered("holdfast fit --hand = l"), " left \n");
  EXPECT_THAT(Offered("holdfast grasp mu"), HasSubstr(" mug "));
  EXPECT_THAT(Offered("holdfast fit mi"), HasSubstr(" mine.npz "));
  EXPECT_THAT(Offered("holdfast score --"), Not(HasSubstr("--closings")));
}

}  // namespace
}  // namespace holdfast
