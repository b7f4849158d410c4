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

}  // namespace holdfast::testing
