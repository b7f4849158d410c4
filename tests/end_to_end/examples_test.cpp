// SPDX-License-Identifier: MIT
// Every example of every --help, of the README and of the pages in docs/ runs as pasted into a
// shell: one after the other, in a folder with the files that they name.
#include <sys/wait.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/example_files.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using testing::ExampleFiles;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;
using testing::TemporaryFolder;

// Work that nobody waits for in a test: what of an example is replaced by what.
struct Reduced {
  std::string part, replacement, reason;
};
const std::vector<Reduced> kReduced = {
    {"-o reaches --hours 4", "-o reaches --hours 0.02", "hours of motion, minutes of work"},
    {"-o reaches --hours 6", "-o reaches --hours 0.02 --held-out cmu_08,cmu_39",
     "hours of motion, minutes of work; of four people none is a tenth"},
    {"-o left --hours 0.5", "-o left --hours 0.02", "half an hour of motion"},
    {"--count 2500", "--count 2", "seconds a clip"},
    {"--variants 500", "--variants 3", "a tenth of a second a variant"},
    {"-o few --count 20", "-o few --count 2", "seconds a clip"},
    {"-o both --count 20", "-o both --count 2", "seconds a clip"},
    {"fit demo_drink mug -o held", "fit demo_drink mug --end 60 -o held", "it is looked at often"},
    {"fit walk.npz banana.obj", "fit walk.npz banana.obj --end 40", "eight seconds of motion"},
    {"-o hand_%03d.png", "-o hand_%03d.png --every 12", "a tenth of a second a picture"},
    {"--optimized 800", "--optimized 1", "thirty reaches a minute"},
    {"-o held.mp4", "-o held.mp4 --every 12", "a tenth of a second a picture"},
    {"--actions clip_embeddings", "--actions clip_embeddings_8",
     "512 numbers an action; the fixtures' networks have 8"},
};

// Commands whose examples take long even so: in tests of their own.
const std::set<std::string> kSlowMotion = {"offhand", "reach",      "refine",
                                           "render",  "synthesize", "transfer"};
const std::set<std::string> kSlowStudies = {"make-actions"};

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// The commands that a help lists under "Subcommands:".
std::vector<std::string> SubcommandsOf(const std::string& help) {
  std::vector<std::string> names;
  bool listing = false;
  for (const std::string& line : Lines(help)) {
    if (line == "Subcommands:") {
      listing = true;
    } else if (listing && (line.empty() || !line.starts_with("  "))) {
      break;
    } else if (listing && line[2] != ' ') {
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
  }
  return names;
}

// "" (the program itself) and all commands below, with the help of each.
void AddHelp(const std::string& command, std::map<std::string, std::string>& helps) {
  const TemporaryFolder folder;
  const ProgramResult run = RunHoldfast(folder.Path(), command + " --help");
  ASSERT_EQ(run.exit_code, 0) << command << ": " << run.err;
  helps[command] = run.out;
  for (const std::string& name : SubcommandsOf(run.out)) {
    AddHelp(command.empty() ? name : command + " " + name, helps);
  }
}

const std::map<std::string, std::string>& Helps() {
  static const auto helps = [] {
    std::map<std::string, std::string> all;
    AddHelp("", all);
    return all;
  }();
  return helps;
}

// Command lines: "  holdfast ...", continued where a line ends with a backslash.
std::vector<std::string> ExamplesOf(const std::string& help) {
  std::vector<std::string> examples;
  bool goes_on = false;
  for (const std::string& line : Lines(help)) {
    if (goes_on) {
      examples.back() += "\n" + line;
    } else if (line.starts_with("  holdfast ")) {
      examples.push_back(line.substr(2));
    } else {
      continue;
    }
    goes_on = line.ends_with('\\');
  }
  return examples;
}

std::string Shortened(std::string example) {
  for (const Reduced& reduced : kReduced) {
    const auto at = example.find(reduced.part);
    if (at != std::string::npos) example.replace(at, reduced.part.size(), reduced.replacement);
  }
  return example;
}

// Words of a command line without quotes, comment and what is told to be written.
std::vector<std::string> ReadWords(const std::string& example) {
  std::vector<std::string> words;
  std::string word;
  char quote = 0;
  bool written = false;
  const auto end = [&] {
    if (!word.empty() && !written) words.push_back(word);
    if (!word.empty())
      written = word == "-o" || word == "--output" || word == "--csv" || word == "--film";
    word.clear();
  };
  for (const char c : example) {
    if (quote == 0 && c == '#') break;
    if (quote == 0 && (c == '"' || c == '\'')) {
      quote = c;
    } else if (c == quote) {
      quote = 0;
    } else if (quote == 0 && (std::isspace(static_cast<unsigned char>(c)) || c == '\\')) {
      end();
    } else {
      word += c;
    }
  }
  end();
  return words;
}

// Puts what the example reads into the folder; a file that nobody makes is a fault of the test.
void PlaceFiles(const std::string& example, ExampleFiles& files, const fs::path& folder) {
  for (std::string word : ReadWords(example)) {
    if (const auto equals = word.find('='); equals != std::string::npos) {
      word = word.substr(equals + 1);  // NAME=FILE
    }
    const bool number = word.find_first_not_of("0123456789.,-") == std::string::npos;
    if (word.starts_with('-') || number) continue;
    if (const auto colon = word.find(':'); colon != std::string::npos) word.resize(colon);
    if (fs::exists(folder / word) || files.Place(word, folder)) continue;
    const auto dot = word.rfind('.');
    const bool file =
        word.find('/') != std::string::npos || (dot != std::string::npos && dot + 1 < word.size());
    EXPECT_FALSE(file && word.find(' ') == std::string::npos)
        << "'" << example << "' names " << word
        << ", which tests/support/example_files.h does not make and no example before it writes";
  }
}

ProgramResult RunInShell(const std::string& line, const fs::path& folder) {
  const fs::path program = HOLDFAST_PROGRAM;
  std::ofstream(folder / ".script")
      << "set -e -o pipefail\nPATH='" << program.parent_path().string() << "':$PATH\n"
      << line << "\n";
  const std::string command =
      "cd '" + folder.string() + "' && bash .script </dev/null >.stdout 2>.stderr";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, ReadText(folder / ".stdout"),
          ReadText(folder / ".stderr")};
}

// One example in the folder; says so where it cannot be run here.
void RunExample(const std::string& line, ExampleFiles& files, const fs::path& folder,
                const std::string& where) {
  try {
    PlaceFiles(line, files, folder);
    if (files.PlaceResultOf(line, folder)) {
      fmt::print("    made  {}\n", line);
      return;
    }
  } catch (const ExampleFiles::NoData& absent) {
    fmt::print("  without {}, left out: {}\n", absent.file.string(), line);
    return;
  }
  const auto begin = std::chrono::steady_clock::now();
  const ProgramResult run = RunInShell(line, folder);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  fmt::print("{:6.1f} s  {}\n", seconds.count(), line);
  std::fflush(stdout);
  EXPECT_EQ(run.exit_code, 0) << where << "\n" << line << "\n" << run.err;
}

void RunExamples(const std::vector<std::string>& examples, ExampleFiles& files,
                 const std::string& where) {
  const TemporaryFolder folder;
  for (const std::string& example : examples) {
    RunExample(Shortened(example), files, folder.Path(), where);
  }
}

template <typename Chosen>
void RunHelps(const Chosen& chosen) {
  ExampleFiles files;
  for (const auto& [command, help] : Helps()) {
    if (!chosen(command)) continue;
    const std::vector<std::string> examples = ExamplesOf(help);
    EXPECT_TRUE(!examples.empty() || !SubcommandsOf(help).empty())
        << "holdfast " << command << " --help has no example";
    RunExamples(examples, files, "holdfast " + command + " --help");
  }
}

// Blocks between fences that name no language.
std::vector<std::vector<std::string>> BlocksOf(const std::string& markdown) {
  std::vector<std::vector<std::string>> blocks;
  bool inside = false, shell = false;
  for (const std::string& line : Lines(markdown)) {
    if (line.starts_with("```")) {
      inside = !inside;
      shell = inside && line == "```";
      if (shell) blocks.emplace_back();
    } else if (inside && shell) {
      blocks.back().push_back(line);
    }
  }
  return blocks;
}

TEST(ExamplesOfHelp, RunAsPasted) {
  RunHelps([](const std::string& command) {
    return !kSlowMotion.contains(command) && !kSlowStudies.contains(command);
  });
}

TEST(ExamplesOfHelp, OfMotionAndPicturesRunAsPasted) {
  RunHelps([](const std::string& command) { return kSlowMotion.contains(command); });
}

TEST(ExamplesOfHelp, OfSetsAndStudiesRunAsPasted) {
  RunHelps([](const std::string& command) { return kSlowStudies.contains(command); });
}

// Names that begin with "--" in a text.
std::set<std::string> OptionsIn(const std::string& text) {
  static const std::regex kOption("(^|[^-a-z])(--[a-z][a-z0-9-]*[a-z0-9])");
  std::set<std::string> options;
  for (std::sregex_iterator at(text.begin(), text.end(), kOption), end; at != end; ++at) {
    options.insert((*at)[2]);
  }
  return options;
}

TEST(Help, SaysWhatEveryOptionDoes) {
  constexpr std::size_t kColumn = 30;  // where descriptions begin, or on the next line
  for (const auto& [command, help] : Helps()) {
    const std::vector<std::string> lines = Lines(help);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (!lines[i].starts_with("  -")) continue;
      const bool beside = lines[i].size() > kColumn && lines[i][kColumn - 1] == ' ';
      const bool below =
          i + 1 < lines.size() && lines[i + 1].starts_with(std::string(kColumn, ' '));
      EXPECT_TRUE(beside || below) << command << ":" << lines[i];
    }
  }
}

TEST(Help, NamesEveryOptionOfTheDocumentation) {
  // Of cmake; of Snakemake; of tests/evaluation/transfers.py; of Chromium, beside a picture;
  // --lambda-*; misspelt in troubleshooting.md.
  std::set<std::string> known = {"--build",
                                 "--preset",
                                 "--profile",
                                 "--install",
                                 "--films",
                                 "--robots",
                                 "--headless",
                                 "--no-sandbox",
                                 "--screenshot",
                                 "--hide-scrollbars",
                                 "--enable-unsafe-swiftshader",
                                 "--window-size",
                                 "--virtual-time-budget",
                                 "--lambda",
                                 "--hnad"};
  for (const auto& [command, help] : Helps()) known.merge(OptionsIn(help));
  std::vector<fs::path> pages = {fs::path(HOLDFAST_SOURCE_DIR) / "README.md"};
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(HOLDFAST_SOURCE_DIR) / "docs")) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  }
  // Studies and training are of the Python module.
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(HOLDFAST_SOURCE_DIR) / "python" / "holdfast")) {
    if (entry.path().extension() == ".py") known.merge(OptionsIn(ReadText(entry.path())));
  }
  for (const fs::path& page : pages) {
    for (const std::string& option : OptionsIn(ReadText(page))) {
      EXPECT_TRUE(known.contains(option)) << page << " has " << option << ", which no command has";
    }
  }
}

// The site's builder says so too, where it is installed.
TEST(Documentation, EveryPageIsInTheSitesIndex) {
  const fs::path docs = fs::path(HOLDFAST_SOURCE_DIR) / "docs";
  const std::string index = ReadText(docs / "index.md");
  for (const auto& entry : fs::recursive_directory_iterator(docs)) {
    const std::string page = fs::relative(entry.path(), docs).replace_extension().string();
    if (entry.path().extension() != ".md" || page == "index" || page == "README") continue;
    EXPECT_THAT(index, ::testing::HasSubstr("\n" + page + "\n"));
  }
}

TEST(ExamplesOfHelp, AreReducedOnlyWhereTheyStand) {
  std::string all;
  for (const auto& [command, help] : Helps()) all += help;
  all += ReadText(fs::path(HOLDFAST_SOURCE_DIR) / "docs" / "tutorials" / "train.md");
  for (const Reduced& reduced : kReduced) {
    EXPECT_THAT(all, ::testing::HasSubstr(reduced.part)) << "no example has it any more";
  }
}

// A session: lines that are typed, behind "$ ", and what is answered, messages included.
void RunSession(const std::vector<std::string>& session, ExampleFiles& files) {
  const TemporaryFolder folder;
  std::string answered;
  for (const std::string& line : session) {
    if (!line.starts_with("$ ")) continue;
    PlaceFiles(line.substr(2), files, folder.Path());
    const ProgramResult run = RunInShell(line.substr(2), folder.Path());
    answered += line + "\n" + run.out + run.err;
  }
  EXPECT_EQ(answered, fmt::format("{}\n", fmt::join(session, "\n")));
}

// What stands in fenced blocks of a document: how many there are.
std::size_t RunBlocks(const std::string& document) {
  // It installs packages and builds.
  const std::string setup = ReadText(fs::path(HOLDFAST_SOURCE_DIR) / "setup");
  ExampleFiles files;
  std::vector<std::string> examples;
  const auto blocks = BlocksOf(ReadText(fs::path(HOLDFAST_SOURCE_DIR) / document));
  for (const auto& block : blocks) {
    if (block.front().starts_with("$ ")) {
      RunSession(block, files);
      continue;
    }
    for (const std::string& line : block) {
      if (line.starts_with("./setup ") && setup.find("#   " + line + " ") != std::string::npos)
        continue;
      EXPECT_THAT(line, ::testing::StartsWith("holdfast ")) << document << ": nothing to paste";
      examples.push_back(line);
    }
  }
  RunExamples(examples, files, document);
  return blocks.size();
}

std::size_t RunBlocksOfFolder(const std::string& folder) {
  std::size_t blocks = 0;
  std::set<std::string> pages;  // in an order that does not depend on the machine
  for (const auto& entry : fs::directory_iterator(fs::path(HOLDFAST_SOURCE_DIR) / folder)) {
    if (entry.path().extension() == ".md") pages.insert(entry.path().filename().string());
  }
  for (const std::string& page : pages) blocks += RunBlocks(folder + "/" + page);
  return blocks;
}

TEST(ExamplesOfReadme, RunAsPasted) { EXPECT_GT(RunBlocks("README.md"), 0u); }

TEST(ExamplesOfDocs, RunAsPasted) { EXPECT_GT(RunBlocksOfFolder("docs"), 0u); }

TEST(ExamplesOfTutorials, RunAsPasted) { EXPECT_GT(RunBlocksOfFolder("docs/tutorials"), 0u); }

}  // namespace
}  // namespace holdfast
