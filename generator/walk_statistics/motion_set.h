// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace holdfast {

/// A clip of a set of motions.
struct MotionFile {
  std::string path;  ///< or the name of an embedded clip
  std::string name;  ///< display name: without folder and extension
};

/// A labeled set of motions.
struct MotionSet {
  std::string label;
  std::vector<MotionFile> files;
};

/// Returns one clip, or all clips (.npz) in and below a folder by path. A clip.npz next to samples
/// is the best of them and is skipped. Throws Error for a folder without clips.
std::vector<MotionFile> MotionFilesOf(const std::string& path);

}  // namespace holdfast
