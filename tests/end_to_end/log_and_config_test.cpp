// SPDX-License-Identifier: MIT
// What every command has: --verbose, --log json, --config and --print-config.
#include <sys/stat.h>

#include <fstream>
#include <sstream>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramFolder;
using testing::ProgramResult;

using Log = testing::ProgramTest;

// Each line of a log, which is an object with a time, a level and an event.
std::vector<nlohmann::json> LogLines(const std::string& err) {
  std::vector<nlohmann::json> lines;
  std::istringstream stream(err);
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(nlohmann::json::parse(line, nullptr, false));
    EXPECT_TRUE(lines.back().is_object()) << line;
    if (!lines.back().is_object()) return {};
    for (const char* key : {"time", "level", "event"})
      EXPECT_TRUE(lines.back().contains(key)) << line;
  }
  return lines;
}

// The only line of an event.
nlohmann::json LineOf(const std::vector<nlohmann::json>& lines, const std::string& event) {
  nlohmann::json found;
  for (const auto& line : lines) {
    if (line["event"] != event) continue;
    EXPECT_TRUE(found.is_null()) << event << " is there twice";
    found = line;
  }
  EXPECT_FALSE(found.is_null()) << event << " is not there";
  return found.is_null() ? nlohmann::json::object() : found;
}

constexpr const char* kFrames = "export demo_drink -o body_%04d.ply --every 72 -f";

TEST_F(Log, AsJsonHasProgressDetailsAndSummary) {
  const ProgramResult plain = folder.Run(kFrames);
  EXPECT_EQ(plain.err, "");
  const ProgramResult result = folder.Run(std::string(kFrames) + " --log json --verbose");
  EXPECT_EQ(result.out, plain.out);
  const auto lines = LogLines(result.err);
  EXPECT_EQ(LineOf(lines, "loaded")["file"], "demo_drink");
  const auto progress = LineOf(lines, "progress");
  EXPECT_EQ(progress["level"], "info");
  EXPECT_EQ(progress["stage"], "export");
  EXPECT_EQ(progress["done"], progress["total"]);
  EXPECT_EQ(LineOf(lines, "stage")["level"], "debug");
  EXPECT_GT(LineOf(lines, "usage")["peak_memory_mb"].get<double>(), 1.0);
  EXPECT_EQ(LineOf(lines, "summary")["summary"]["format"], "ply");
}

TEST_F(Log, AsJsonHasNotesAndFaults) {
  folder.Run("grasp cube -o grip.npz -q");
  const ProgramResult note = folder.Run("export grip.npz -o a.bvh --log json");
  EXPECT_THAT(LineOf(LogLines(note.err), "note")["message"].get<std::string>(),
              ::testing::StartsWith("a .bvh file stores only the skeleton"));

  const ProgramResult fault = folder.Run("export none.npz -o a.glb --log json -q", 1);
  const auto error = LineOf(LogLines(fault.err), "error");
  EXPECT_EQ(error["level"], "error");
  EXPECT_EQ(error["where"], "none.npz");
  EXPECT_EQ(error["exit_code"], 1);
  const ProgramResult usage = folder.Run("export a --log json --ouput b", 2);
  EXPECT_THAT(LineOf(LogLines(usage.err), "error")["message"].get<std::string>(),
              HasSubstr("--output"));
}

TEST_F(Log, QuietLeavesWarningsAndNoneFaultsOnly) {
  EXPECT_EQ(folder.Run(std::string(kFrames) + " -q --log json").err, "");
  // Says that it assumes a right hand, and warns of the missing translation.
  const std::string import =
      "import " HOLDFAST_SOURCE_DIR "/tests/fixtures/hand_sets/mano_poses.npy -o hand.npz --force ";
  EXPECT_THAT(folder.Run(import).err, HasSubstr("assuming 30 Hz"));
  const std::string quiet = folder.Run(import + "-q").err;
  EXPECT_THAT(quiet, HasSubstr("warning: the array holds poses only"));
  EXPECT_THAT(quiet, ::testing::Not(HasSubstr("note: ")));
  EXPECT_EQ(folder.Run(import + "--log none").err, "");
  folder.Fails(std::string(kFrames) + " -q -v", 2, "--quiet excludes --verbose");
}

TEST_F(Log, VerboseTellsTheSolversEnd) {
  folder.Run("grasp cube -o grip.npz -q");
  const ProgramResult fit = folder.Run("fit grip.npz cube -o held --no-report -v");
  for (const char* said :
       {"loaded grip.npz: 1 frames", "loaded cube: ", "solver: frames: ", ", CPU time "}) {
    EXPECT_THAT(fit.err, HasSubstr(said));
  }
}

TEST(Config, SetsWhatTheCommandLineDoesNot) {
  const ProgramFolder folder;
  std::ofstream(folder / "jobs.toml") << "# for all\n"
                                         "threads = 1\n"
                                         "\n"
                                         "[export]\r\n"
                                         "clip = \"demo_drink\"  # an argument\n"
                                         "output = 'a.npz'\n"
                                         "start = 3\n"
                                         "end = 20\n"
                                         "no_object = true\n"
                                         "force = false\n"
                                         "\n"
                                         "[grasp]\n"
                                         "at = [\n  0.1,\n  0.2, 0.3\n]\n";
  const ProgramResult result = folder.Run("export --config jobs.toml --end 9 --json -q");
  EXPECT_EQ(nlohmann::json::parse(result.out)["frames"], 6);
  folder.Run("export --config jobs.toml -q", 1);  // no --force

  // Printed, and read again.
  const ProgramResult printed = folder.Run("export --config jobs.toml --end 9 --print-config");
  EXPECT_THAT(printed.out, HasSubstr("[export]\nclip = \"demo_drink\"\noutput = \"a.npz\"\n"));
  EXPECT_THAT(printed.out, HasSubstr("\nend = 9\n"));
  EXPECT_THAT(printed.out, HasSubstr("\n# every = 1\n"));
  std::ofstream(folder / "again.toml") << printed.out;
  const ProgramResult again = folder.Run("export --config again.toml -o b.npz --json -q");
  EXPECT_EQ(nlohmann::json::parse(again.out)["frames"], 6);
  EXPECT_THAT(folder.Run("grasp cube -o g.npz --config jobs.toml --print-config").out,
              HasSubstr("\nat = [0.1, 0.2, 0.3]\n"));
}

TEST(Config, FaultsNameFileAndKey) {
  struct Fault {
    std::string text, said;
  };
  const std::string deep(900'000, '[');
  const std::vector<Fault> faults = {
      {"threads = 1\nstrat = 1\n",
       "config:2: 'strat' is not an option of 'holdfast export'. Did you mean 'start'"},
      {"start = soon\n", "config:1: 'start': "},
      {"start = nan\n", "config:1: 'start': "},
      {"start = 99999999999999999999\n", "config:1: 'start': "},
      {"start = [1, 2]\n", "config:1: 'start': "},
      {"tolerance = 1e300\n", "config:1: 'tolerance': "},
      {"no-object = maybe\n", "config:1: 'no-object': expected true or false"},
      {"start = 1\nstart = 2\n", "config:2: 'start' is set twice"},
      {"[exprot]\nstart = 1\n", "config:2: '[exprot]' is not a command"},
      {"config = \"config\"\n", "'config' is not an option"},
      {"start\n", "config:1: is not KEY = VALUE"},
      {"start =\n", "config:1: has no value"},
      {"body = \"a\n", "config:1: has a quote that is not closed"},
      {"body = \"a\" b\n", "config:1: has extra text after its value"},
      {"start = [1,\n", "is in a list without ']'"},
      {std::string("start = 1\n\0", 11), "config: is not a text"},
      {"\x7f"
       "ELF",
       "config: is not a text"},
      {"", "config: is empty"},
      {deep, "config:1: has a section without ']'"},
      {std::string(2'000'000, '#'), "config: is larger than"}};
  for (const Fault& fault : faults) {
    const ProgramFolder folder;
    std::ofstream(folder / "config", std::ios::binary) << fault.text;
    folder.Fails("export demo_drink -o a.bvh --config config", 1, fault.said);
  }
  const ProgramFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  const std::string config = "export demo_drink -o a.bvh --config ";
  folder.Fails(config + "pipe", 1, "pipe: is not a regular file");
  folder.Fails(config + ".", 1, ".: is a folder");
  folder.Fails(config + "none.toml", 1, "none.toml: does not exist");
}

}  // namespace
}  // namespace holdfast
