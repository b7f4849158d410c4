// SPDX-License-Identifier: MIT
#include "solver/evaluation/study_blocks.h"

#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/json_file.h"

namespace holdfast {

namespace fs = std::filesystem;

bool TakeBlock(const fs::path& file, bool is_asked, bool replace, const char* configuration,
               const std::function<bool()>& take) {
  if (!is_asked) {
    if (replace) return false;
    throw Error(file.string(),
                fmt::format("holds results of a different configuration ({})", configuration),
                "Choose another folder, or --force to replace them");
  }
  try {
    if (take()) return true;
  } catch (const nlohmann::json::exception&) {  // damaged, as with the wrong number of motions
  } catch (const Error&) {
  }
  throw Error(file.string(), "is damaged", "Delete it: its motions are made again");
}

fs::path TimesFile(fs::path block) { return block.replace_extension(".timing.json"); }

StudyBlocks::StudyBlocks(fs::path folder, bool replace)
    : folder_(std::move(folder)), replace_(replace) {
  fs::create_directories(folder_);
}

fs::path StudyBlocks::File(const std::string& name, int block) const {
  return folder_ / fmt::format("{}_{:03d}.json", name, block);
}

bool StudyBlocks::Read(const std::string& name, int block, const std::string& question,
                       const std::function<bool(const nlohmann::json& motions)>& take) const {
  const fs::path file = File(name, block);
  if (!fs::exists(file)) return false;
  nlohmann::json out = ReadJson(file);
  const nlohmann::json times = ReadJson(TimesFile(file));
  return TakeBlock(file, out.contains("question") && out["question"] == question, replace_,
                   "network, start poses, protocol, method or seed", [&] {
                     if (!times.is_discarded()) PutBackWallTimes(times, out);
                     return take(out.at("motions"));
                   });
}

void StudyBlocks::Write(const std::string& name, int block, const std::string& question,
                        nlohmann::json out) const {
  out["question"] = question;
  WriteWithoutWallTimes(std::move(out), File(name, block), TimesFile(File(name, block)));
}

}  // namespace holdfast
