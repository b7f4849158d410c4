// SPDX-License-Identifier: MIT
// Mistakes of the first hour: what the program says to a command line that is not quite right.
#include <fstream>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::Listing;
using ::testing::Not;
using testing::ProgramFolder;
using testing::ProgramResult;

TEST(CommandLine, AloneItListsTheCommands) {
  const ProgramFolder folder;
  const ProgramResult alone = folder.Run("", 2);
  EXPECT_EQ(alone.out, folder.Run("--help").out);
  EXPECT_THAT(alone.out, HasSubstr("decimate"));
}

struct Mistake {
  std::string name, arguments;
  int exit_code;
  std::string said;
};

std::ostream& operator<<(std::ostream& out, const Mistake& mistake) { return out << mistake.name; }

class FirstHour : public ::testing::TestWithParam<Mistake> {};

TEST_P(FirstHour, MistakeIsAnsweredWithWhatToType) {
  const Mistake& mistake = GetParam();
  const ProgramFolder folder;
  std::ofstream(folder / "picture.png") << "\x89PNG\r\n\x1a\n";
  std::ofstream(folder / "film.mp4") << std::string(
      "\0\0\0\x20"
      "ftypisom",
      12);
  const std::string before = Listing(folder.Path());
  const ProgramResult result = folder.Run(mistake.arguments, mistake.exit_code);
  EXPECT_THAT(result.err, HasSubstr(mistake.said));
  EXPECT_THAT(result.err, Not(HasSubstr("Run with --help")));
  EXPECT_EQ(Listing(folder.Path()), before);
}

INSTANTIATE_TEST_SUITE_P(
    Each, FirstHour,
    ::testing::Values(
        Mistake{"Command", "fti demo_drink mug -o held", 2, "Did you mean 'fit'? Run 'holdfast --"},
        Mistake{"CommandOfAnother", "grab mug", 2, "there is no command 'grab'"},
        Mistake{"Option", "fit demo_drink mug --ouput held", 2,
                "holdfast fit: there is no option '--ouput'. Did you mean '--output'?"},
        Mistake{"OptionWithValue", "render demo_drink -o a.png --siez=80x120", 2, "'--size'"},
        Mistake{"OptionBeforeCommand", "--json fit demo_drink mug -o held", 2,
                "'--json' is given before the command"},
        Mistake{"NoOutput", "fit demo_drink mug", 2,
                "holdfast fit: --output is required. Run 'holdfast fit --help'"},
        Mistake{"NoObject", "fit demo_drink -o held", 2, "object"},
        Mistake{"OneTooMany", "render demo_drink mug -o a.png", 2, "unexpected argument 'mug'"},
        Mistake{"PictureAsMesh", "fit demo_drink picture.png -o held", 1,
                "picture.png: '.png' is not a supported mesh format"},
        Mistake{"PictureAsClip", "fit picture.png mug -o held", 1, "picture.png"},
        Mistake{"FilmAsClip", "render film.mp4 -o a.png", 1, "film.mp4"}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace holdfast
