// SPDX-License-Identifier: MIT
#include "solver/evaluation/study_blocks.h"

#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/read_json.h"

namespace holdfast {

namespace fs = std::filesystem;

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
  const nlohmann::json out = ReadJson(file);
  if (!out.contains("question") || out["question"] != question) {
    if (replace_) return false;
    throw Error(file.string(),
                "holds results of a different configuration (network, start poses, protocol, "
                "method or seed)",
                "Choose another folder, or --force to replace them");
  }
  try {
    if (take(out.at("motions"))) return true;
  } catch (const nlohmann::json::exception&) {
    // falls through: damaged, as with the wrong number of motions
  }
  throw Error(file.string(), "is damaged", "Delete it: its motions are made again");
}

void StudyBlocks::Write(const std::string& name, int block, const std::string& question,
                        nlohmann::json out) const {
  out["question"] = question;
  WriteAtomically(File(name, block), out.dump() + "\n");
}

}  // namespace holdfast
