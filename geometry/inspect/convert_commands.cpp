// SPDX-License-Identifier: MIT
#include "geometry/inspect/convert_commands.h"

#include <fmt/format.h>

#include "geometry/inspect/inspection.h"

namespace holdfast {
namespace {

std::string Python(const std::string& code, const std::filesystem::path& path,
                   const std::string& suffix) {
  return fmt::format("python3 -c 'import sys, numpy as np; {}' {} {}", code, ShellWord(path),
                     ShellWord(Stem(path) + suffix + ".npz"));
}

// Loads a clip as a dictionary, changes it, saves it.
std::string Change(const std::string& code, const std::filesystem::path& path,
                   const std::string& suffix) {
  return Python("d = dict(np.load(sys.argv[1])); " + code + "; np.savez(sys.argv[2], **d)", path,
                suffix);
}

}  // namespace

std::string TurnUpCommand(const std::filesystem::path& path, int axis, int sign) {
  return fmt::format("holdfast import {} --up={}{} -o {}", ShellWord(path), sign < 0 ? "-" : "",
                     "xyz"[axis], ShellWord(Stem(path) + "_zup.npz"));
}

std::string ScaleCommand(const std::filesystem::path& path, double factor) {
  return fmt::format("holdfast import {} --metres-per-unit {:g} -o {}", ShellWord(path), factor,
                     ShellWord(Stem(path) + "_m.npz"));
}

std::string TransposeObjectCommand(const std::filesystem::path& path) {
  return Change("d[\"object_orient\"] = -d[\"object_orient\"]", path, "_columns");
}

}  // namespace holdfast
