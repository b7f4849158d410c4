// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace holdfast {

/// Whether `a` comes before `b` the way people number things: "frame_9" before "frame_10".
bool NaturalLess(const std::string& a, const std::string& b);

/// The files of a folder that hold one clip frame by frame.
struct FrameFiles {
  std::vector<std::filesystem::path> files;  ///< in natural order
  int people = 1;                            ///< most that any frame has files of
  int missing = 0;                           ///< numbers left out between the first and the last
};

/// Finds them: `000001.pkl ...`; with several people `00001_0.npz, 00001_1.npz` (frame, person); or
/// `<frame>/000.pkl` (SMPLify-X). All of the extension that most files have, of .pkl .npz .npy
/// .json .pt .pth. Of several people the `person`-th is taken. Throws Error for a folder without
/// any and a person that is not there.
FrameFiles FindFrameFiles(const std::filesystem::path& folder, int person);

}  // namespace holdfast
