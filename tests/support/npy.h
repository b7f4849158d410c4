// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace holdfast::testing {

/// Writes numbers as numpy's .npy (float32); `shape` as in its header: "(2, 21, 3)".
inline void WriteNpy(const std::filesystem::path& path, const std::string& shape,
                     const std::vector<float>& values) {
  constexpr std::size_t kHead = 117;  // and a line feed: 128 bytes with the first ten
  std::string head = "{'descr': '<f4', 'fortran_order': False, 'shape': " + shape + ", }";
  head.resize(kHead, ' ');
  head += '\n';
  std::ofstream file(path, std::ios::binary);
  file << "\x93NUMPY\x01" << '\0' << static_cast<char>(head.size()) << '\0' << head;
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(sizeof(float) * values.size()));
}

}  // namespace holdfast::testing
