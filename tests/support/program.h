// SPDX-License-Identifier: MIT
#pragma once

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.h"

namespace holdfast::testing {

/// What a run of the program left behind.
struct ProgramResult {
  int exit_code = -1;
  std::string out;
  std::string err;
};

inline std::string ReadText(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Runs `holdfast ARGUMENTS` in `folder` through the shell, after `prefix` ("ulimit -f 8;").
inline ProgramResult RunHoldfast(const std::filesystem::path& folder, const std::string& arguments,
                                 const std::string& prefix = "") {
  const std::string command = "cd '" + folder.string() + "' && " + prefix +
                              " '" HOLDFAST_PROGRAM "' " + arguments + " >.stdout 2>.stderr";
  const int status = std::system(("bash -c \"" + command + "\"").c_str());
  ProgramResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  result.out = ReadText(folder / ".stdout");
  result.err = ReadText(folder / ".stderr");
  std::filesystem::remove(folder / ".stdout");
  std::filesystem::remove(folder / ".stderr");
  return result;
}

/// Names of everything in a folder, hidden files too, sorted.
inline std::string Listing(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  std::string text;
  for (const std::string& name : names) text += name + " ";
  return text;
}

/// A folder of its own that the program runs in.
class ProgramFolder : public TemporaryFolder {
 public:
  /// Runs `holdfast ARGUMENTS`; the test fails unless it ends with `exit_code`.
  ProgramResult Run(const std::string& arguments, int exit_code = 0,
                    const std::string& prefix = "") const {
    const ProgramResult result = RunHoldfast(Path(), arguments, prefix);
    EXPECT_EQ(result.exit_code, exit_code) << arguments << "\n" << result.out << result.err;
    return result;
  }

  /// What it prints with --json.
  nlohmann::json Json(const std::string& arguments, int exit_code = 0) const {
    return nlohmann::json::parse(Run(arguments + " --json", exit_code).out);
  }

  /// Runs it and expects that it ends with `exit_code`, says this and leaves nothing.
  void Fails(const std::string& arguments, int exit_code, const std::string& said,
             const std::string& prefix = "") const {
    const std::string before = Listing(Path());
    const ProgramResult result = Run(arguments, exit_code, prefix);
    EXPECT_THAT(result.err, ::testing::HasSubstr(said)) << arguments;
    EXPECT_EQ(Listing(Path()), before) << arguments;
  }

  nlohmann::json ReadJson(const std::string& name) const {
    return nlohmann::json::parse(ReadText(Path() / name));
  }
};

/// A test that runs the program in a folder of its own.
class ProgramTest : public ::testing::Test {
 protected:
  ProgramFolder folder;
};

}  // namespace holdfast::testing
