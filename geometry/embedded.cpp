// SPDX-License-Identifier: MIT
#include "geometry/embedded.h"

#include <algorithm>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {

EmbeddedFile FindEmbedded(std::string_view name) {
  const auto files = EmbeddedFiles();
  const auto it = std::ranges::find(files, name, &EmbeddedFile::name);
  if (it != files.end()) return *it;
  std::string known;
  for (const EmbeddedFile& file : files) known += fmt::format(" {}", file.name);
  throw Error(name, "is not among the files inside the program", "There are:" + known);
}

bool HasEmbedded(std::string_view name) {
  return std::ranges::find(EmbeddedFiles(), name, &EmbeddedFile::name) != EmbeddedFiles().end();
}

std::vector<std::string> EmbeddedNames(std::string_view folder, std::string_view extension) {
  std::vector<std::string> names;
  for (const EmbeddedFile& file : EmbeddedFiles()) {
    if (file.name.size() <= folder.size() + 1 + extension.size()) continue;
    if (!file.name.starts_with(folder) || file.name[folder.size()] != '/') continue;
    if (!file.name.ends_with(extension)) continue;
    names.emplace_back(file.name.substr(folder.size() + 1,
                                        file.name.size() - folder.size() - 1 - extension.size()));
  }
  return names;
}

}  // namespace holdfast
