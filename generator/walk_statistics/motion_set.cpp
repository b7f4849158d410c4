// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/motion_set.h"

#include <algorithm>
#include <filesystem>

#include "geometry/error.h"

namespace holdfast {

namespace fs = std::filesystem;

std::vector<MotionFile> MotionFilesOf(const std::string& path) {
  if (!fs::is_directory(path)) return {{path, fs::path(path).stem().string()}};
  std::vector<MotionFile> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path)) {
    const fs::path& file = entry.path();
    if (file.extension() != ".npz" || !entry.is_regular_file()) continue;
    if (file.filename() == "clip.npz" && fs::is_directory(file.parent_path() / "samples")) continue;
    files.push_back({file.string(), file.lexically_relative(path).replace_extension().string()});
  }
  if (files.empty()) {
    throw Error(path, "has no clip (.npz) in it", "Give the folder that the clips are in");
  }
  std::ranges::sort(files, {}, &MotionFile::path);
  return files;
}

}  // namespace holdfast
