// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>

#include "apps/common.h"
#include "geometry/error.h"

namespace holdfast::apps {
namespace {

// Trains in a program of its own beside this one: it needs LibTorch, which nothing else does.
constexpr const char* kProgram = "holdfast-train";

constexpr const char* kAbsent = "this program was built without training";
constexpr const char* kRemedy =
    "Install libtorch-dev and configure with -DHOLDFAST_BUILD_TRAINING=ON (./setup train).";

std::filesystem::path Program() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / kProgram;
}

[[noreturn]] void Become(const std::vector<std::string>& arguments) {
  const std::filesystem::path program = Program();
  if (!std::filesystem::exists(program)) throw Error("train", kAbsent, kRemedy);
  std::vector<std::string> texts{program.string()};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  ::execv(pointers[0], pointers.data());
  throw Error(program.string(), fmt::format("could not be run: {}", std::strerror(errno)),
              "Check that it is executable");
}

}  // namespace

void AddTrainCommand(CLI::App& app, int&) {
  CLI::App* command =
      app.add_subcommand("train", "Train the networks (wandr, imos); needs LibTorch when built");
  // Everything after the name, --help too, is for the other program.
  command->set_help_flag();
  command->prefix_command();
  command->callback([command] {
    const std::vector<std::string> arguments = command->remaining();
    const bool asks = std::ranges::any_of(
        arguments, [](const std::string& word) { return word == "--help" || word == "-h"; });
    if (asks && !std::filesystem::exists(Program())) {
      fmt::print(
          "Train the networks of 'reach' (wandr) and 'synthesize' (imos, recognizer)\n"
          "Usage: holdfast train NETWORK [OPTIONS]\n\nBut {}. {}\n",
          kAbsent, kRemedy);
      return;
    }
    Become(arguments);
  });
}

}  // namespace holdfast::apps
