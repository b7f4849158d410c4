// SPDX-License-Identifier: MIT
#include "generator/matching/set_manifest.h"

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/json_file.h"

namespace holdfast {

using nlohmann::json;

void WriteManifest(const std::filesystem::path& path, const json& head,
                   const ManifestLines& lines) {
  std::string text = JsonText(head, 1);
  text.resize(text.size() - 2);  // "\n}"
  text += ",\n \"clips\": [";
  const char* between = "\n  ";
  for (const auto& [index, line] : lines) {
    text += between + JsonText(line);
    between = ",\n  ";
  }
  WriteAtomically(path, text + "\n ]\n}\n");
}

ManifestLines LinesBefore(const std::filesystem::path& path, const json& head,
                          std::string_view command, std::string_view made_from, bool replace) {
  if (!std::filesystem::exists(path)) return {};
  const json before = ReadJson(path);
  const auto same = [&](const std::string& key) {
    if (!before.is_object() || !before.contains(key)) return false;
    json asked = head.at(key), had = before[key];
    for (json* const value : {&asked, &had}) {  // a larger set may be requested
      if (value->is_object()) value->erase("hours");
    }
    return asked == had;
  };
  if (!same("schema")) {
    throw Error(path.string(), fmt::format("is not a manifest of '{}'", command),
                "Choose another folder");
  }
  bool same_making = before.contains("clips");
  for (const auto& [key, value] : head.items()) same_making = same_making && same(key);
  if (!same_making) {
    if (replace) return {};
    throw Error(path.string(), fmt::format("is of other {}, options, seed or version", made_from),
                "Choose another folder, or give --force to make it anew");
  }
  return UseJson(path, [&] {
    ManifestLines lines;
    for (const json& line : before["clips"]) lines[line.at("index").get<int>()] = line;
    return lines;
  });
}

void DropLost(ManifestLines& lines, const std::filesystem::path& folder) {
  std::erase_if(lines, [&](const ManifestLines::value_type& line) {
    return line.second.contains("file") &&
           !std::filesystem::exists(folder / line.second.at("file").get<std::string>());
  });
}

}  // namespace holdfast
