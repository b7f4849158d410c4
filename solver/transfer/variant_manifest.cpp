// SPDX-License-Identifier: MIT
#include "solver/transfer/variant_manifest.h"

#include <sstream>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast {

namespace fs = std::filesystem;
using nlohmann::json;

VariantManifest ReadManifest(const fs::path& path, const json& asked) {
  const fs::path folder = path.parent_path();
  VariantManifest before;
  if (!fs::exists(path)) {
    if (fs::exists(folder) && !fs::is_empty(folder)) {
      throw Error(folder.string(), "is not a folder of variants: nothing is written there",
                  "Choose another name");
    }
    return before;
  }
  std::istringstream text(ReadFile(path));
  bool first = true;
  for (std::string line; std::getline(text, line);) {
    const json entry = json::parse(line, nullptr, false);
    if (entry.is_discarded() || !entry.is_object()) break;  // it was stopped while it wrote
    if (first && entry != asked) {
      throw Error(folder.string(), "holds variants of another clip, options or seed",
                  "Choose another folder");
    }
    if (!first) {
      if (entry.value("variant", -1) != before.tried) break;
      ++before.tried;
      before.kept += entry.value("kept", false);
      if (!entry.value("kept", false)) ++before.refused[entry.value("why", "")];
    }
    first = false;
    before.text += line + "\n";
  }
  return before;
}

}  // namespace holdfast
