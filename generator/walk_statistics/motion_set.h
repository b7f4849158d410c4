// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace holdfast {

/// A clip of a set of motions.
struct MotionFile {
  std::string path;  ///< or the name of an embedded clip
  std::string name;  ///< for people: without the folder and extension
};

/// Motions that belong together.
struct MotionSet {
  std::string label;
  std::vector<MotionFile> files;
};

/// A clip by itself, or all clips (.npz) in a folder and below it, by path. Where samples lie
/// beside a clip.npz, that is the best of them and left out. Throws Error for a folder without any.
std::vector<MotionFile> MotionFilesOf(const std::string& path);

}  // namespace holdfast
